/* SPDX-License-Identifier: Apache-2.0 */
/* Names of effects, what omitting each saves, and which cannot be overridden. */
#include "worker/render/world/effects.h"

enum { ON = EFFECT_MAY_FORCE_ON, OFF = EFFECT_MAY_FORCE_OFF, SCENE = EFFECT_MAY_FORCE_OFF | EFFECT_CHANGES_SCENE };

const struct effect_decl effect_table[EFFECTS] = {
	[EFFECT_COLOUR] = {"colour", ON, "drawing, carrying and storing wavelengths; colours become plain numbers",
			   "a coloured scene has no grey values to replace its colours"},
	[EFFECT_WAVELENGTH] = {"wavelength", ON | OFF, "proposals for the wavelength", NULL},
	[EFFECT_DISPERSION] =
		{"dispersion", ON | SCENE,
		 "three of four paths, since four wavelengths share each; walks and derivatives when the wavelength changes",
		 NULL},
	[EFFECT_APERTURE] = {"aperture", ON | SCENE, "the lens mutation; drawing and moving points on the aperture",
			     NULL},
	[EFFECT_EMITTER_MOVE] = {"emitter-move", ON | OFF, "the mutation that moves the point on the emitter", NULL},
	[EFFECT_HALF_VECTORS] = {"half-vectors", ON | OFF,
				 "walks, derivatives and step sizes; paths are traced and joined instead", NULL},
	[EFFECT_SPECULAR] = {"specular", ON | SCENE,
			     "exactly specular chains; half vectors as well, if there are no glossy lobes", NULL},
	[EFFECT_GLOSSY] = {"glossy", ON | SCENE, "microfacets; half vectors as well, if there are no specular lobes",
			   NULL},
	[EFFECT_DIFFUSE] = {"diffuse", ON | SCENE, "nothing, except on paths that meet such a surface", NULL},
	[EFFECT_TRANSMISSION] = {"transmission", ON | SCENE, "nothing, except on paths that meet such a surface", NULL},
	[EFFECT_ABSORPTION] = {"absorption", ON | SCENE, "a medium and an exponential per edge", NULL},
	[EFFECT_SCATTERING] =
		{"scattering", OFF | EFFECT_CHANGES_SCENE,
		 "drawing distances; paths turn at surfaces only, and chains on half vectors can be chosen",
		 "scattering by media is part of the scene"},
	[EFFECT_TEXTURES] = {"textures", ON, "look-ups by (u,v); colours are constants",
			     "a textured scene has no other colours"},
	[EFFECT_DISPLACEMENT] = {"displacement", ON | SCENE, "the time and memory that finer meshes take", NULL},
	[EFFECT_BUMP] = {"bump", 0, "bending normals; those of the mesh are used",
			 "bump and normal maps cost nothing where no material has one"},
	[EFFECT_ALPHA] = {"alpha", 0, "an opacity test per ray, a filter in Embree", "masks are specular lobes"},
	[EFFECT_COINCIDENCE] = {"coincidence", 0, "a test per ray of which of two surfaces is present",
				"whether surfaces coincide is a property of the scene"},
	[EFFECT_INSTANCING] = {"instancing", 0, "transforms between rays and meshes",
			       "whether instances share a mesh is a property of the scene"},
	[EFFECT_MOTION] = {"motion", OFF | EFFECT_CHANGES_SCENE,
			   "drawing and storing a time; everything stays where it is when the shutter opens",
			   "what moves is part of the scene"},
	[EFFECT_ENVIRONMENT] = {"environment", ON | SCENE, "following rays that escape", NULL},
	[EFFECT_AREA_LIGHT] = {"area-light", ON | SCENE, "nothing, except on paths that end on one", NULL},
	[EFFECT_DELTA_LIGHT] = {"delta-light", ON | SCENE, "nothing, except on paths that end on one", NULL},
	[EFFECT_MEDIUM_LIGHT] = {"medium-light", OFF | EFFECT_CHANGES_SCENE,
				 "collecting light along edges; chains on half vectors can be chosen",
				 "emission by media is part of the scene"},
	[EFFECT_TRANSPARENT_SHADOWS] =
		{"transparent-shadows", ON | OFF,
		 "the second ray of blocked connections; chance alone finds light behind such surfaces", NULL},
	[EFFECT_REFRACTED_SHADOWS] = {"refracted-shadows", ON | OFF,
				      "the walks of blocked connections; chance alone finds light behind such surfaces",
				      NULL},
	[EFFECT_DEPTH] = {"depth", ON, "trying longer paths", "--max-depth shortens paths"},
};
