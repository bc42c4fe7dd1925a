/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/image/calibration_scenes.h"

#include "tests/support/worlds.h"

#include <string.h>

#define TO_WORLD(inner) "<transform name='to_world'>" inner "</transform>"
#define DEPTH(n) "<integrator type='path'><integer name='max_depth' value='" n "'/></integrator>"
#define DIFFUSE(rgb) "<bsdf type='diffuse'><rgb name='reflectance' value='" rgb "'/></bsdf>"
#define BOX(bsdf) "<shape type='cube'>" TO_WORLD("<scale value='2'/>") bsdf "</shape>"
#define VIEW SENSOR("0,0.2,1.9", "0,-0.3,-1")
#define AREA_EMITTER(rgb) "<emitter type='area'><rgb name='radiance' value='" rgb "'/></emitter>"
#define CEILING(size, rgb)                                                                                             \
	"<shape type='rectangle'>" TO_WORLD("<scale value='" size "'/><rotate x='1' angle='90'/><translate y='1.9'/>") \
		AREA_EMITTER(rgb) "</shape>"
#define SPHERE(at, radius, inner)                                                                                   \
	"<shape type='sphere'><point name='center' value='" at "'/><float name='radius' value='" radius "'/>" inner \
	"</shape>"
#define GLASS "<bsdf type='dielectric'/>"
#define ROUGH_GLASS(alpha) "<bsdf type='roughdielectric'><float name='alpha' value='" alpha "'/></bsdf>"
#define METAL(alpha) \
	"<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha' value='" alpha "'/></bsdf>"
#define MIRROR "<bsdf type='conductor'><string name='material' value='Ag'/></bsdf>"
#define WALL(turn, move, inner) "<shape type='rectangle'>" TO_WORLD(turn move) inner "</shape>"
/* clang-format off */
#define CHECKERBOARD(a, b, n)                                                                                                          \
	"<bsdf type='diffuse'><texture name='reflectance' type='checkerboard'><rgb name='color0' value='" a                        \
	"'/><rgb name='color1' value='" b "'/><transform name='to_uv'><scale x='" n "' y='" n "'/></transform></texture></bsdf>"
/* clang-format on */

/* A part of a metal ring that stands on the floor. */
#define RING_SEGMENT(degrees)                                                                   \
	WALL("<scale x='0.28' y='0.3'/><translate z='-1'/><rotate y='1' angle='" degrees "'/>", \
	     "<translate y='-0.7'/>", METAL("0.05"))
#define WARM DIFFUSE("0.5,0.45,0.35")
/* clang-format off */
#define VOLPATH "<integrator type='volpath'><integer name='max_depth' value='12'/></integrator>"
#define MEDIUM(id, sigma_t, albedo, g)                                                                                           \
	"<medium type='homogeneous' id='" id "'><rgb name='sigma_t' value='" sigma_t "'/><rgb name='albedo' value='" albedo        \
	"'/><phase type='hg'><float name='g' value='" g "'/></phase></medium>"
#define VIEW_IN(medium)                                                                                                          \
	"<sensor type='perspective'><float name='fov' value='50'/><transform name='to_world'>"                                     \
	"<lookat origin='0,0.2,1.8' target='0,-0.3,-1' up='0,1,0'/></transform><ref id='" medium "'/>"                             \
	"<film type='hdrfilm'><rfilter type='box'/></film></sensor>"
/* clang-format on */
#define INTERIOR(id) "<ref name='interior' id='" id "'/>"
#define FLOOR WALL("<scale value='8'/><rotate x='1' angle='-90'/>", "<translate y='-1'/>", DIFFUSE("0.4,0.4,0.4"))

/* The three kinds alternate, so that an interrupted run has some scenes of each. */
const struct calibration_scene calibration_scenes[] = {
	{"tree", "box", "box", "box.xml", NULL, "path", 25},
	{"public", "cornell-box", "cornell-box", "scene.xml", NULL, "path", 35},
	{"made", "room", NULL, NULL,
	 DEPTH("5") VIEW BOX(WARM) CEILING("0.8", "6,5,4") SPHERE("0,-0.6,-0.3", "0.8", DIFFUSE("0.2,0.5,0.7")), "path",
	 30},
	{"tree", "demo", "demo", "scene.xml", NULL, "bdpt", 30},
	{"public", "veach-mis", "veach-mis", "scene.xml", NULL, "bdpt8", 30},
	{"made", "lamp in a glass shell", NULL, NULL,
	 DEPTH("8") VIEW BOX(WARM) SPHERE("0,0.4,-0.6", "0.5", GLASS)
		 SPHERE("0,0.4,-0.6", "0.05", AREA_EMITTER("600,500,400")),
	 "bdpt", 60},
	{"made", "caustic ring", NULL, NULL,
	 DEPTH("6") SENSOR("0,3,4", "0,-0.5,0")
		 WALL("<scale value='6'/><rotate x='1' angle='-90'/>", "<translate y='-1'/>", DIFFUSE("0.4,0.4,0.4"))
			 RING_SEGMENT("-60") RING_SEGMENT("-30") RING_SEGMENT("0") RING_SEGMENT("30") RING_SEGMENT("60")
				 SPHERE("2,2,1", "0.1", AREA_EMITTER("300,300,250")),
	 "bdpt", 30},
	{"made", "dark checks", NULL, NULL,
	 DEPTH("6") VIEW BOX(CHECKERBOARD("0.02,0.02,0.02", "0.8,0.8,0.7", "8"))
		 WALL("<scale value='1.2'/><rotate x='1' angle='90'/>", "<translate y='1.2'/>", DIFFUSE("0.1,0.1,0.1"))
			 CEILING("0.5", "30,28,25"),
	 "bdpt", 35},
	{"made", "lamp behind cloudy glass", NULL, NULL,
	 DEPTH("8") VIEW BOX(WARM) SPHERE("0,0.4,-0.6", "0.6", ROUGH_GLASS("0.2"))
		 SPHERE("0,0.4,-0.6", "0.1", AREA_EMITTER("200,180,150")),
	 "bdpt", 70},
	{"tree", "water", "displaced", "water.xml", NULL, "hslt", 40},
	{"public", "three-spheres", ".", "three-spheres.xml", NULL, "bdpt", 40},
	{"made", "glossy box", NULL, NULL,
	 DEPTH("8") VIEW BOX(METAL("0.1")) CEILING("0.3", "20,18,15") SPHERE("0.3,-0.8,-0.5", "0.5", METAL("0.05")),
	 "bdpt", 40},
	{"made", "mirror corridor", NULL, NULL,
	 DEPTH("12") SENSOR("0,0,1.9", "0.6,-0.2,-1") BOX(DIFFUSE("0.3,0.3,0.35"))
		 WALL("<scale x='1.9' y='1.9'/><rotate y='1' angle='90'/>", "<translate x='-1.5'/>", MIRROR)
			 WALL("<scale x='1.9' y='1.9'/><rotate y='1' angle='-90'/>", "<translate x='1.5'/>", MIRROR)
				 CEILING("0.2", "40,38,35"),
	 "bdpt", 40},
	{"public", "half-sunk", ".", "half-sunk-rough.xml", NULL, "bdpt", 40},
	{"made", "tiny bright emitter", NULL, NULL,
	 DEPTH("6") VIEW BOX(WARM) SPHERE("-1,1,-1", "0.01", AREA_EMITTER("30000,28000,25000"))
		 SPHERE("0.4,-0.8,-0.3", "0.7", GLASS) SPHERE("-0.9,-1.2,-0.2", "0.5", METAL("0.1")),
	 "bdpt", 40},
	{"tree", "frosted", "displaced", "frosted.xml", NULL, "hslt", 40},
	{"tree", "smoke", "smoke", "scene.xml", NULL, "bdpt", 60},
	{"made", "fog", NULL, NULL,
	 VOLPATH MEDIUM("fog", "0.35,0.35,0.35", "0.9,0.9,0.9", "0.5") VIEW_IN("fog") BOX(WARM INTERIOR("fog"))
		 CEILING("0.3", "30,26,20") SPHERE("0.4,-1.2,-0.6", "0.7", DIFFUSE("0.2,0.5,0.7"))
			 SPHERE("-0.9,-1.4,-0.2", "0.5", METAL("0.15")),
	 "bdpt", 60},
	{"made", "milk in glass", NULL, NULL,
	 VOLPATH SENSOR("0,1,4", "0,-0.2,0") MEDIUM("milk", "6,7,9", "0.99,0.98,0.95", "0")
		 SPHERE("-0.75,-0.3,0", "0.7", GLASS INTERIOR("milk"))
			 SPHERE("0.85,-0.3,0.2", "0.7", ROUGH_GLASS("0.15") INTERIOR("milk"))
				 FLOOR SPHERE("1,3,1.5", "0.15", AREA_EMITTER("300,280,240")),
	 "hslt", 60},
	{"public", "veach-door", "veach-door", "scene.xml", NULL, "bdpt", 40},
	{NULL, NULL, NULL, NULL, NULL, NULL, 0},
};

struct world *calibration_world(const struct calibration_scene *s, uint32_t width, uint32_t height)
{
	if (s->xml)
		return world_from_text(width, height, "%s", s->xml);
	if (strcmp(s->kind, "public") == 0)
		return world_from_public_scene(s->folder, s->file, width, height);
	return world_from_own_scene(s->folder, s->file, width, height);
}
