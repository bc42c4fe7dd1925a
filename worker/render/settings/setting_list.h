/* SPDX-License-Identifier: Apache-2.0 */
/* One line per setting: field of struct accuracy_settings; name; kind; what it affects; default, least and greatest
 * value; choices, of which the first has the value 0 unless they are numbers; what the setting does, in one
 * sentence; values worth a sweep. */
SETTING(tolerance, "tolerance", SETTING_REAL, SETTING_CHAINS, 1e-3, 1e-9, 1, NULL,
	"Residual at which a walk has reached its half vectors, relative to the lobe or the step, whichever is smaller",
	"0.1", "0.01", "0.001", "0.0001", "1e-05", "1e-06", "1e-08")
SETTING(iterations, "iterations", SETTING_INTEGER, SETTING_CHAINS, 15, 1, 1000, NULL,
	"Newton steps before a walk fails", "2", "3", "4", "6", "10", "15", "30")
SETTING(least_step, "least-step", SETTING_REAL, SETTING_CHAINS, 0.3, 1e-9, 1, NULL,
	"Fraction of a Newton step below which a diverging walk fails", "1", "0.3", "0.1", "0.03", "0.001", "1e-05")
SETTING(reverse_tolerance, "reverse-tolerance", SETTING_REAL, SETTING_CHAINS, 1e-3, 1e-9, 0.5, NULL,
	"How close to its start the reverse walk must end, relative to the largest step of a vertex", "0.1", "0.01",
	"0.001", "0.0001", "1e-06")
SETTING(precision, "precision", SETTING_CHOICE, SETTING_CHAINS, SETTING_DOUBLE, SETTING_DOUBLE, SETTING_SINGLE,
	"double single",
	"Precision of the matrices that walks and densities of half vectors solve; positions are double", "double",
	"single")
SETTING(step_scale, "step-scale", SETTING_REAL, SETTING_CHAINS, 1, 1e-3, 1000, NULL,
	"Scales the largest step of a half vector; 1: a lobe's mean slope", "0.1", "0.25", "0.5", "1", "2", "4")
SETTING(wavelengths, "wavelengths", SETTING_CHOICE, SETTING_PATHS, 4, 1, 4, "1 2 4",
	"Wavelengths carried along each path where nothing disperses", "1", "2", "4")
SETTING(roughness, "roughness", SETTING_REAL, SETTING_WORLD, 0, 0, 1, NULL,
	"Rough metal and glass below this roughness become smooth", "0", "0.001", "0.003", "0.01", "0.03", "0.1")
SETTING(tessellation, "tessellation", SETTING_REAL, SETTING_WORLD, 1, 1e-3, 64, NULL,
	"Scales the number of pieces into which displacement cuts an edge", "0.125", "0.25", "0.5", "1", "2")
SETTING(colour, "colour", SETTING_CHOICE, SETTING_WORLD, 0, 0, 1, "spectral rgb",
	"Light and colours are spectra, or R, G and B as in most renderers: then nothing disperses", NULL)
SETTING(emitter_choice, "emitter-choice", SETTING_CHOICE, SETTING_WORLD, SETTING_BY_PLACE, SETTING_BY_PLACE,
	SETTING_BY_POWER, "place power",
	"How one of several emitters is chosen: by the light that arrives from each at the lit place, or by power",
	NULL)
SETTING(backs, "backs", SETTING_CHOICE, SETTING_WORLD, SETTING_BACKS_AUTO, SETTING_BACKS_AUTO, SETTING_BACKS_BLACK,
	"auto lit black",
	"Whether backs of opaque materials without twosided scatter light as fronts do, or are black; auto: black in files of 3.x",
	NULL)
SETTING(media, "media", SETTING_CHOICE, SETTING_WORLD, SETTING_MEDIA_AUTO, SETTING_MEDIA_AUTO, SETTING_MEDIA_NONE,
	"auto shown none",
	"Whether media are shown; auto: not where the scene's own integrator leaves them out, such as path", NULL)
SETTING(lenient, "lenient", SETTING_CHOICE, SETTING_WORLD, 0, 0, 1, "no yes",
	"Whether unsupported features are left out or replaced by the nearest supported ones, with a note for each",
	NULL)
SETTING(sensor, "sensor", SETTING_INTEGER, SETTING_WORLD, 1, 1, 1000, NULL,
	"Which of the scene's sensors is used, counted from 1", NULL)
