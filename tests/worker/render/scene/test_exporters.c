/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Scenes as exporters write them, with the parameters that they write by default: each is read without a problem. By
 * the exporters' sources; tests/corpus/README.md.
 */
#include "tests/support/memory_assets.h"
#include "worker/render/render.h"
#include "worker/render/scene/scene.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define INTEGER(name, value) "<integer name='" name "' value='" value "'/>"
#define FLOAT(name, value) "<float name='" name "' value='" value "'/>"
#define BOOLEAN(name, value) "<boolean name='" name "' value='" value "'/>"
#define STRING(name, value) "<string name='" name "' value=\"" value "\"/>"
#define SPECTRUM(name, value) "<spectrum name='" name "' value='" value "'/>"
#define RGB(name, value) "<rgb name='" name "' value='" value "'/>"
#define TO_WORLD(content) "<transform name='toWorld'>" content "</transform>"
#define MATRIX "<matrix value='-0.5 0 0 1 0 0.5 0 4 0 0 -0.5 0 0 0 0 1'/>"

static const char blender_05[] =
	"<?xml version='1.0' encoding='utf-8'?><!-- # Main Scene File --><scene version='0.5.0'>"
	"<integrator name='elm0' type='path'>" BOOLEAN("hideEmitters", "true") INTEGER("maxDepth", "16")
		BOOLEAN("strictNormals", "false") INTEGER(
			"rrDepth",
			"10") "</integrator>"
			      "<sensor name='elm1' type='thinlens' id='Camera-camera'>" TO_WORLD(
				      "<lookat origin='7.48, 5.34, 6.50' target='6.82, 4.89, 5.89' up='-0.31, 0.89, -0.31'/>")
				      STRING("fovAxis", "x") FLOAT("fov", "49.134342") FLOAT(
					      "nearClip", "0.100000") FLOAT("farClip",
									    "100.000000") FLOAT("apertureRadius",
												"0.030000")
					      FLOAT("focusDistance", "10") FLOAT("shutterOpen", "0.02") FLOAT(
						      "shutterClose",
						      "0.04") "<sampler name='sampler' type='sobol'>" INTEGER("sampleCount",
													      "16")
						      INTEGER("scramble", "-1") "</sampler><film name='film' type='ldrfilm'>" INTEGER(
							      "width", "96") INTEGER("height", "54")
							      STRING("fileFormat", "png")
								      STRING("pixelFormat", "rgb")
									      STRING("tonemapMethod", "gamma")
										      FLOAT("gamma", "-1.000000")
											      FLOAT("exposure",
												    "0.000000")
												      BOOLEAN("banner", "true") BOOLEAN("highQualityEdges", "false") STRING("label[10,10]", "Integrator:$integrator['type'], $film['width']x$film['height'],"
																							    "$sampler['sampleCount']spp, rendertime:$scene['renderTime']") "<rfilter name='rfilter' type='gaussian'>" FLOAT("stddev", "0.500000") "</rfilter></film></sensor>"
																																								  "<shape name='elm2' type='rectangle' id='Area-arealight'><emitter name='emitter' type='area'>" SPECTRUM("radiance", "20.000000 20.000000 20.000000") FLOAT("samplingWeight", "1.000000") "</emitter><bsdf name='bsdf' type='null'/>" TO_WORLD(MATRIX) "</shape>"
																																																																							"<emitter name='elm3' type='spot' id='Spot-spotlight'>" FLOAT(
																																																																								"cutoffAngle",
																																																																								"37.5")
																																																																								FLOAT("beamWidth",
																																																																								      "37.5") SPECTRUM("intensity",
																																																																										       "20 20 20")
																																																																									FLOAT("samplingWeight", "1.0") "<texture name='texture' type='bitmap'>" STRING("filename", "t.tga") STRING("wrapModeU", "zero") STRING("wrapModeV",
																																																																																									       "one") STRING("filterType",
																																																																																											     "ewa") FLOAT("maxAnisotropy",
																																																																																													  "20") BOOLEAN("cache",
																																																																																															"true") "</texture>" TO_WORLD(MATRIX) "</emitter>"
																																																																																																			      "<emitter name='elm5' type='sunsky' id='Environment-sunsky'>" FLOAT(
																																																																																																				      "samplingWeight", "1") FLOAT("turbidity",
																																																																																																								   "3") INTEGER("year",
																																																																																																										"2010")
																																																																																																				      INTEGER("month", "7") INTEGER("day", "10") FLOAT(
																																																																																																					      "hour",
																																																																																																					      "15.000") FLOAT("minute",
																																																																																																							      "0.0")
																																																																																																					      FLOAT(
																																																																																																						      "second",
																																																																																																						      "0.0") FLOAT("latitude",
																																																																																																								   "35.689400")
																																																																																																						      FLOAT("longitude",
																																																																																																							    "139.691700")
																																																																																																							      FLOAT("timezone",
																																																																																																								    "9.000000")
																																																																																																								      SPECTRUM("albedo", "0.15 0.15 0.15") INTEGER("resolution",
																																																																																																														   "512") FLOAT("stretch",
																																																																																																																"1.0") BOOLEAN("extend",
																																																																																																																	       "false")
																																																																																																									      FLOAT("skyScale",
																																																																																																										    "1") FLOAT("sunScale", "1") FLOAT("sunRadiusScale", "1") "</emitter>"
																																																																																																																	     "<bsdf name='elm6' type='roughdielectric' id='M1'>" FLOAT("intIOR",
																																																																																																																								       "1.000277") FLOAT("extIOR", "1.000277") SPECTRUM("specularReflectance", "1 1 1") SPECTRUM("specularTransmittance",
																																																																																																																																				 "1 1 1") FLOAT("alphaU",
																																																																																																																																						"0.1") FLOAT("alphaV",
																																																																																																																																							     "0.3") STRING("distribution", "phong") "</bsdf>"
																																																																																																																																												    "<bsdf name='elm7' type='roughconductor' id='M2'>" FLOAT("extEta", "1.000277") SPECTRUM("specularReflectance", "1 1 1") SPECTRUM(
																																																																																																																																													    "eta",
																																																																																																																																													    "0.37 0.37 0.37") SPECTRUM("k",
																																																																																																																																																       "2.82 2.82 2.82") FLOAT("alpha", "0.1") STRING("distribution",
																																																																																																																																																						      "ggx") "</bsdf>"
																																																																																																																																																							     "<bsdf name='e9' type='blendbsdf' id='M4'>" FLOAT("weight",
																																																																																																																																																													       "0.5") "<ref name='bsdf1' id='M2'/>"
																																																																																																																																																														      "<bsdf name='bsdf2' type='mask'>" SPECTRUM("opacity", "0.5 0.5 0.5") "<bsdf name='bsdf' type='ward'>" FLOAT("alphaU", "0.1") FLOAT("alphaV", "0.1") STRING("variant", "balanced") "</bsdf></bsdf></bsdf>"
																																																																																																																																																																																					"<bsdf name='e10' type='bumpmap' id='M5'><texture name='texture' type='scale'>" FLOAT("scale", "2") "<texture name='bumpmap' type='gridtexture'>" FLOAT(
																																																																																																																																																																																						"lineWidth", "0.01") "</texture></texture>"
																																																																																																																																																																																								     "<bsdf name='bsdf' type='coating'>" FLOAT("thickness",
																																																																																																																																																																																													       "1") FLOAT("intIOR", "1.5") FLOAT("extIOR",
																																																																																																																																																																																																		 "1.000277") SPECTRUM("sigmaA",
																																																																																																																																																																																																				      "0 0 0")
																																																																																																																																																																																									     SPECTRUM("specularReflectance", "1 1 1") "<bsdf name='bsdf' type='roughplastic'>" FLOAT("alpha", "0.1") BOOLEAN(
																																																																																																																																																																																										     "nonlinear", "true") STRING("distribution", "beckmann") "</bsdf></bsdf></bsdf>"
																																																																																																																																																																																																	     "<shape name='e11' type='shapegroup' id='G'><shape name='shape' type='serialized'>" STRING(
																																																																																																																																																																																																		     "filename", "Scene/00001/Cube_0000_m000.serialized") BOOLEAN("faceNormals",
																																																																																																																																																																																																										  "true") "<ref name='bsdf' id='M5'/></shape></shape>"
																																																																																																																																																																																																											  "<shape name='e12' type='instance' id='I'><ref name='shapegroup' id='G'/>" TO_WORLD(MATRIX) "</shape>"
																																																																																																																																																																																																																						      "<shape name='e13' type='sphere' id='P-pointlight'>" FLOAT("radius",
																																																																																																																																																																																																																														 "0.2") "<ref name='bsdf' id='M1'/>"
																																																																																																																																																																																																																															"<animation name='toWorld'><transform time='0'>" MATRIX
																																																																																																																																																																																																																															"</transform></animation></shape>"
																																																																																																																																																																																																																															"<shape name='e14' type='ply'>" STRING("filename",
																																																																																																																																																																																																																																			       "a.ply") "<ref name='bsdf' id='M4'/></shape></scene>";

static const char blender_3[] =
	"<scene version='3.0.0'><default name='spp' value='64'/><default name='resx' value='64'/>"
	"<integrator type='path' id='elm__0' name='elm__0'>" INTEGER("max_depth", "12") INTEGER("rr_depth", "5")
		BOOLEAN("hide_emitters",
			"false") "</integrator>"
				 "<sensor type='perspective' id='elm__1' name='elm__1'>" STRING("fov_axis", "x") FLOAT(
					 "fov", "39.597755") FLOAT("principal_point_offset_x",
								   "0.000000") FLOAT("principal_point_offset_y",
										     "-0.000000") FLOAT("near_clip",
													"0.100000")
					 FLOAT("far_clip",
					       "100.000000") "<transform name='to_world'><rotate x='1' angle='-179.99999499104388'/><rotate y='1' angle='3.2'/>"
							     "<translate value='0.000000 2.5 10'/></transform>"
							     "<sampler type='independent' name='sampler'>" INTEGER(
								     "sample_count",
								     "$spp") "</sampler>"
									     "<film type='hdrfilm' name='film'>" INTEGER(
										     "width", "$resx") INTEGER("height", "36") STRING("pixel_format", "rgb") "<rfilter type='gaussian' name='rfilter'>" FLOAT("stddev", "0.5") "</rfilter></film></sensor>"
																											       "<texture type='bitmap' id='tex'>" STRING("filename", "textures/t.tga") BOOLEAN("raw", "true") "<transform name='to_uv'><scale x='2' y='3' z='1'/><rotate z='1' angle='30'/><translate x='0.1' y='0.2' z='0'/>"
																																							      "</transform></texture>"
																																							      "<bsdf type='twosided' id='mat-M' name='mat-M'><bsdf type='principled' name='bsdf'>" RGB("base_color",
																																																		       "0.8 0.8 0.8") RGB("spec_tint",
																																																					  "1 1 1") FLOAT("metallic", "0") FLOAT("anisotropic", "0") "<ref name='roughness' id='tex'/>" FLOAT("sheen", "0.0") RGB("sheen_tint", "1 1 1") FLOAT("clearcoat", "0") FLOAT("clearcoat_gloss",
																																																																										      "0.03") FLOAT("specular",
																																																																												    "1.001") "</bsdf></bsdf>"
																																																																													     "<bsdf type='principled' id='mat-N'>" RGB(
																																																																														     "base_color",
																																																																														     "0.8 0.8 0.8")
																																																																														     FLOAT(
																																																																															     "spec_trans", "1") FLOAT("eta",
																																																																																		      "1.45") FLOAT("roughness", "0") "</bsdf>"
																																																																																						      "<shape type='rectangle' id='emit-Area'>" BOOLEAN(
																																																																																							      "flip_normals", "true") "<transform name='to_world'><rotate x='1' angle='120'/><scale value='0.5'/></transform>"
																																																																																										      "<emitter type='area' name='emitter'>" RGB("radiance", "79.5 79.5 79.5") "</emitter>"
																																																																																																			       "<bsdf type='null' name='bsdf'/></shape>"
																																																																																																			       "<emitter type='spot' id='emit-Spot'>" RGB("intensity", "79 79 79") FLOAT(
																																																																																																				       "cutoff_angle",
																																																																																																				       "22.5")
																																																																																																				       FLOAT("beam_width",
																																																																																																					     "22.5") "<transform name='to_world'><translate value='0 4 0'/></transform></emitter>"
																																																																																																						     "<emitter type='point' id='emit-P'><point name='position' x='4' y='1' z='5'/>" RGB("intensity",
																																																																																																																	"79 79 79") "</emitter>"
																																																																																																																		    "<shape type='ply' id='mesh-A'>" STRING("filename",
																																																																																																																							    "meshes/A.ply") BOOLEAN("face_normals",
																																																																																																																										    "true") "<ref id='mat-M' name='bsdf'/></shape>"
																																																																																																																											    "<shape type='shapegroup' id='mesh-X'><shape type='ply' name='X'>" STRING(
																																																																																																																												    "filename", "meshes/X.ply") "<ref id='mat-N' name='bsdf'/></shape></shape>"
																																																																																																																																"<shape type='instance'><ref id='mesh-X' name='shape'/><transform name='to_world'><translate x='2'/></transform>"
																																																																																																																																"</shape>"
																																																																																																																																"<emitter type='envmap' id='World' name='World'>" STRING("filename", "textures/e.exr") FLOAT("scale",
																																																																																																																																											     "1.0") "<transform name='to_world'><rotate x='1' angle='90'/></transform></emitter></scene>";

static const char rhino[] = "<?xml version='1.0'?> <scene version='0.5.0'><integrator type='photonmapper'>" INTEGER(
	"maxDepth", "-1")
	INTEGER("globalPhotons", "250000") "</integrator><sampler type='independent'>" INTEGER(
		"sampleCount",
		"4") "</sampler><sensor type='perspective'>" STRING("fovAxis",
								    "diagonal") FLOAT("fov",
										      "50") FLOAT("focusDistance", "3")
		TO_WORLD("<matrix value='1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1'/>") "<film type='hdrfilm'>" INTEGER("width", "1024") INTEGER(
			"height",
			"768") "</film></sensor>"
			       "<emitter type='sunsky'>" TO_WORLD("<rotate x='1' angle='90'/>") BOOLEAN("extend", "true") FLOAT(
				       "sunRadiusScale",
				       "10") "</emitter>"
					     "<shape type='rectangle'>" TO_WORLD(
						     "<scale x='1000' y='1000' z='10'/><translate z='-1'/>") "</shape>"
													     "<bsdf type='dielectric' id='glass'>" STRING(
														     "intIOR",
														     "Bk7")
														     STRING("extIOR",
															    "Air") "</bsdf>"
																   "<shape type='serialized'>" STRING(
																	   "filename",
																	   "a.serialized")
																	   INTEGER("shapeIndex",
																		   "3") "<ref id='glass'/>"
																			"</shape></scene>";

static const char maya[] = "<?xml version='1.0' encoding='utf-8'?><scene version='0.4.0'><integrator type='bdpt'>" INTEGER(
	"maxDepth", "-1") BOOLEAN("lightImage", "true") BOOLEAN("sampleDirect", "true")
	INTEGER("emitterSamples",
		"1") "</integrator>"
		     "<emitter type='sunsky'>" FLOAT(
			     "turbidity",
			     "3") FLOAT("stretch",
					"1") INTEGER("resolutionX", "512")
			     INTEGER("resolutionY", "512") FLOAT("sunScale", "1") FLOAT("skyScale", "1") FLOAT(
				     "sunRadiusScale",
				     "1") "</emitter><bsdf type='twosided' id='m'><bsdf type='diffuse' id='mInnerMaterial'><srgb name='reflectance' "
					  "value='0.5 0.5 0.5'/></bsdf></bsdf><bsdf type='dielectric' id='g'>" STRING(
						  "distribution", "beckmann") FLOAT("alpha", "0.1") FLOAT("intIOR",
													  "1.5")
						  FLOAT("extIOR", "1") "</bsdf>"
								       "<shape type='obj'>" STRING(
									       "filename",
									       "a.obj") "<ref id='m'/></shape></scene>";

static void test_are_read(void **state)
{
	(void)state;
	static const struct {
		const char *exporter, *xml;
	} scenes[] = {{"Blender, 0.5", blender_05}, {"Blender, 3.x", blender_3}, {"Rhino", rhino}, {"Maya", maya}};
	for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
		const struct memory_file files[] = {{"s.xml", scenes[i].xml, strlen(scenes[i].xml)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read_all(&s, &assets, "s.xml", render_plugins(), NULL, 0, false, &e))
			fail_msg("%s: %s", scenes[i].exporter, e.text);
		for (uint32_t k = 0; k < s.problem_count; k++)
			print_error("%s: %s\n", scenes[i].exporter, s.problems[k]);
		assert_int_equal(s.problem_count, 0);
		scene_fini(&s);
	}
}

/* What Mitsuba allows in <scene> beside the version, and what editors of XML add there; also in included files. */
static void test_roots(void **state)
{
	(void)state;
	static const char *const roots[] = {
		"<scene version='3.0.0' type='scene' id='all' name='whole'>",
		"<scene xmlns:xi='http://www.w3.org/2001/XInclude' version='3.0.0' xmlns='x'>",
		"<scene version='0.6.0' id='all' xmlns:xsi='x' xsi:noNamespaceSchemaLocation='s.xsd'>",
	};
	for (size_t i = 0; i < sizeof roots / sizeof *roots; i++) {
		char inner[256];
		snprintf(inner, sizeof inner, "%s<bsdf type='diffuse' id='all'/></scene>", roots[i]);
		char outer[256];
		snprintf(outer, sizeof outer, "%s<include filename='i.xml'/></scene>", roots[i]);
		const struct memory_file files[] = {
			{"s.xml", outer, strlen(outer)}, {"i.xml", inner, strlen(inner)}, {0}};
		struct asset_source assets = memory_assets(files);
		struct scene s;
		struct error e;
		if (scene_read(&s, &assets, "s.xml", render_plugins(), NULL, 0, &e))
			fail_msg("%s: %s", roots[i], e.text);
		assert_int_equal(s.object_count, 1);
		assert_string_equal(s.objects[0]->id, "all");
		assert_int_equal(s.note_count, 0);
		scene_fini(&s);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(test_are_read), cmocka_unit_test(test_roots)};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
