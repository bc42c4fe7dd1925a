/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/placed_scene.h"

#include "tests/support/worlds.h"

struct world *placed_scene_make(double s, double m, const char *ball, const char *cube)
{
#define P(x) (s * (x) + m)
	/* clang-format off */
	return world_from_text(PLACED_SCENE_SIDE, PLACED_SCENE_SIDE,
		"<sensor type='perspective'>"
			"<float name='fov' value='45'/>"
			"<float name='near_clip' value='%.17g'/>"
			"<float name='far_clip' value='%.17g'/>"
			"<transform name='to_world'>"
				"<lookat origin='%.17g,%.17g,%.17g' target='%.17g,%.17g,%.17g' up='0,1,0'/>"
			"</transform>"
			"<film type='hdrfilm'><rfilter type='box'/></film>"
		"</sensor>"
		"<shape type='rectangle'>"
			"<transform name='to_world'>"
				"<scale value='%.17g'/>"
				"<rotate x='1' angle='-90'/>"
				"<translate x='%.17g' y='%.17g' z='%.17g'/>"
			"</transform>"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='%.17g' y='%.17g' z='%.17g'/>"
			"<float name='radius' value='%.17g'/>"
			"%s"
		"</shape>"
		"<shape type='cube'>"
			"<transform name='to_world'>"
				"<scale value='%.17g'/>"
				"<translate x='%.17g' y='%.17g' z='%.17g'/>"
			"</transform>"
			"%s"
		"</shape>"
		"<shape type='sphere'>"
			"<point name='center' x='%.17g' y='%.17g' z='%.17g'/>"
			"<float name='radius' value='%.17g'/>"
			"<emitter type='area'><float name='radiance' value='5'/></emitter>"
		"</shape>",
		s * 0x1p-7, s * 1000, P(0), P(2), P(5), P(0), P(0.5), P(0), 4 * s, P(0), P(0), P(0), P(-0.75),
		P(0.75), P(0.5), 0.75 * s, ball, 0.5 * s, P(1), P(0.5), P(-0.25), cube, P(1), P(3), P(1), 0.5 * s);
	/* clang-format on */
#undef P
}
