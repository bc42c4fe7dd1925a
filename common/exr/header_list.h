/* SPDX-License-Identifier: Apache-2.0 */
/* The attributes: ROW(NAME, name in the file, type, whether equal renders may differ in it, meaning). */
ROW(VERSION, "hslt:version", STRING, false, "version of the programs")
ROW(SCENE, "hslt:scene", STRING, false, "name of the scene file")
/* Excluded from comparisons: differently written files may describe the same scene. */
ROW(SCENE_HASH, "hslt:sceneHash", STRING, true, "SHA-256 of the scene file")
ROW(CAMERA, "hslt:camera", STRING, false,
    "the camera as name=value pairs: fov in degrees, to_world by rows (x left, y up, z forward)")
ROW(INTEGRATOR, "hslt:integrator", STRING, false, "path, bdpt, pssmlt, hslt, ...")
ROW(MIXTURE, "hslt:mixture", STRING, false,
    "strategies that propose mutations, with their shares (Metropolis with several)")
ROW(OPTIONS, "hslt:options", STRING, false,
    "options of hslt-render and hslt-submit that, with the same scene and files, reproduce the same bits")
ROW(SEED, "hslt:seed", STRING, false, "seed of all random numbers")
ROW(MIN_DEPTH, "hslt:minDepth", INT, false, "shortest paths, in edges")
ROW(MAX_DEPTH, "hslt:maxDepth", INT, false, "longest paths, in edges")
ROW(GROUPS, "hslt:groups", INT, false, "independent replicates")
ROW(CHAINS, "hslt:chains", INT, false, "Markov chains of all groups (Metropolis only)")
ROW(BOOTSTRAP, "hslt:bootstrap", STRING, false, "bootstrap samples of all groups")
ROW(EPOCH, "hslt:epoch", STRING, false, "mutations per chain, or samples per pixel and group, in one round")
ROW(ROUNDS, "hslt:rounds", STRING, false, "complete rounds in the image")
ROW(MUTATIONS, "hslt:mutations", STRING, false, "mutations in the image (Metropolis only)")
ROW(SAMPLES, "hslt:samples", STRING, false, "samples per pixel in the image (integrators other than Metropolis)")
ROW(B, "hslt:b", DOUBLE, false, "integral of X+Y+Z over the image, pooled over groups (Metropolis only)")
ROW(B_ERROR, "hslt:bError", DOUBLE, false, "standard error of hslt:b, from the groups; absent where it is not known")
ROW(B_ERROR_DOUBT, "hslt:bErrorDoubt", STRING, false, "why the standard error of hslt:b is not known")
ROW(BEYOND, "hslt:beyondShare", DOUBLE, false, "share of the energy in paths too long for the chains")
ROW(REL_MSE, "hslt:relMSE", DOUBLE, false,
    "estimated relMSE, from the variance between groups; absent where it is not known")
ROW(REL_MSE_UPPER, "hslt:relMSEUpper", DOUBLE, false,
    "upper end of the 90 % interval of relMSE; absent where it is not known")
ROW(REL_MSE_LOW_95, "hslt:relMSELow95", DOUBLE, false,
    "lower end of the interval that holds this image's own relMSE in 95 % of all cases; absent where it is not known")
ROW(REL_MSE_HIGH_95, "hslt:relMSEHigh95", DOUBLE, false, "upper end of the same interval; absent where it is not known")
ROW(REL_MSE_DEFINITION, "hslt:relMSEDefinition", STRING, false, "definition of relMSE")
ROW(REL_MSE_DOUBT, "hslt:relMSEDoubt", STRING, false, "why relMSE or its interval is not known")
ROW(UNVISITED, "hslt:unvisitedPixels", STRING, false,
    "pixels to which no chain came: their error is their neighbours' (Metropolis only)")
ROW(ACCEPTED, "hslt:accepted", STRING, false, "accepted mutations")
ROW(INDEPENDENT, "hslt:independent", STRING, false, "independent proposals of the chains")
ROW(NAN, "hslt:nan", STRING, false, "path contributions refused: not a number")
ROW(INFINITE, "hslt:infinite", STRING, false, "path contributions refused: infinite")
ROW(NEGATIVE, "hslt:negative", STRING, false, "path contributions refused: negative")
ROW(RAYS_CLOSEST, "hslt:raysClosest", STRING, false, "rays traced to the closest hit")
ROW(RAYS_SHADOW, "hslt:raysShadow", STRING, false, "rays traced between two points")
ROW(STUCK, "hslt:stuck", STRING, false, "times that a chain accepted nothing during a whole epoch")
ROW(LONGEST_STUCK, "hslt:longestStuck", STRING, false, "most rejections in a row")
ROW(STRATEGIES, "hslt:strategies", STRING, false, "what each strategy of the mixture did; one per line")
ROW(NOTE, "hslt:note", STRING, false, "notes on the image")
ROW(SCENE_NOTES, "hslt:sceneNotes", STRING, false,
    "notes on the scene file: what is ignored, read otherwise, or replaced by --lenient; one per line")
ROW(AGREEMENT, "hslt:agreement", STRING, false,
    "whether the chains agree: agree, too short, disagree (Metropolis only)")
ROW(DISAGREEMENT, "hslt:disagreement", STRING, false, "what disagrees, where, by how much")
ROW(R_HAT_MEDIAN, "hslt:rHatMedian", DOUBLE, false,
    "potential scale reduction of chains, median over tiles with light; the layer rhat has it by tile")
ROW(R_HAT_WORST, "hslt:rHatWorst", DOUBLE, false, "potential scale reduction of chains, the largest over these tiles")
ROW(CLASSES, "hslt:classes", STRING, false,
    "energy of each class of paths in % of the light, in the bootstrap and in the chains")
ROW(EFFECTS, "hslt:effects", STRING, false, "each effect, on or off, and why; one per line")
ROW(MIXED, "hslt:mixed", INT, false, "1: workers with different arithmetic took part, the bits cannot be reproduced")
ROW(WALL, "hslt:wallSeconds", DOUBLE, true, "wall-clock time from the first bootstrap sample to the last merge")
ROW(CPU, "hslt:cpuSeconds", DOUBLE, true, "CPU time of all leases")
ROW(WORKERS, "hslt:workers", INT, true, "workers that took part (hslt-render: threads)")
ROW(DATE, "hslt:date", STRING, true, "when the image was written, UTC")
/* Excluded from comparisons: a render that ended by time or error has the same bits as one that --mutations ends after
 * the same number of rounds. */
ROW(END, "hslt:end", STRING, true, "which bound ended the render: mutations, time, target-error, black, interrupted")
ROW(CROPS, "hslt:crops", INT, false, "number of crops that hslt-assemble made the image of")
