"""What the status words mean, in a line each."""

MEANINGS = {
    "ok": "measured: every cell of the row is filled, but those that docs/tables.md lets be empty",
    "no_object": "no sphere was found in the frame",
    "no_edge": "the outline could not be located",
    "short_arc": "too little of the outline can be measured, for none is across the water surface",
    "occluded": "splash, cavity or something else hides the sphere",
    "out_of_frame": "the sphere leaves the image",
    "poor_fit": "the shape does not follow the outline, or the frame lies off the course that its neighbours tell",
    "saturated": "the outline lies in pixels at the top of the range",
    "bad_frame": "the frame is damaged",
    "gap": "the camera's numbering skips the frame",
    "interpolated": "the value comes from its neighbours in time",
    "early_shape": "so soon after impact that the shape is still a wave, not an ellipsoid",
    "no_unit_crossing": "the stretch does not cross its mean; the period ends midway between valley and next peak",
    "clip_ended": "the recording ends before it happens",
    "no_neck": "the cavity shows no neck",
    "too_few": "too few measurements or drops for a number",
    "not_identified": "the data do not determine the value",
    "manual": "set by hand in corrections.yaml",
}
