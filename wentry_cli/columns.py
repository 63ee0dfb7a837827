"""The contract of the tables as text: a section a table, a line a column; ``schemas.py`` reads it.

A section starts with ``# table | stage | what a row stands for``. A column is ``name | unit | kind | meaning``; a
fifth part says when the cell may be empty in a row whose status is ``ok``: without it, it never is. A kind with ``±``
adds the column of its standard uncertainty, ``<name>_unc``, empty where the value is; a line ``±`` does the same and
says when it may be empty besides. ``± random`` adds ``<name>_unc_random``, too: what is left of that uncertainty
without what all frames of the clip have in common.
"""

COLUMNS = """
# frames | ingest | view, frame
view | – | text | side or top
frame | 1 | int | index in the clip, from 0, gaps counted
camera_frame | 1 | int | number that the camera or the file name gave
time_s | s | float | mid-exposure on the camera clock, 0 at the side view's first frame
mean_level | grey | float | mean grey level of the region of interest
saturated_fraction | 1 | float | share of pixels at the top of the range
status | – | text | ok, or why something in this row is not measured

# geometry | track | view
view | – | text | side or top
width_px | px | int | width of the picture that is measured, after roi_px and rotate
height_px | px | int | height of that picture
fps | 1/s | float | frame rate used
fps_source | – | text | where the frame rate came from
exposure_s | s | float | exposure of one frame
scale_px_per_m | px/m | float ± | scale in air (top view: in the plane of the free surface)
scale_water_px_per_m | px/m | float ± | scale of what is seen through the water; empty without water or from the top
scale_source | – | text | how each scale was found: given, diameter or wet_ellipse
surface_y_px | px | float ± | row of the undisturbed free surface (surface_impact: of the plate)
surface_x_px | px | float | rolled camera: the column of that row; empty where the surface is level in the picture
roll_deg | ° | float | roll of the camera: the surface falls to the right by it; metres are levelled; empty from the top
optical_axis_y_px | px | float ± | row where the optical axis meets the picture; empty without water
radius_px | px | float ± | radius of the undeformed sphere in air
impact_time_s | s | float ± random | first contact on the camera clock
release_time_s | s | float | side: when a sphere that hangs at first is let go, on the camera clock; else empty
ground_noise | 1 | float | standard deviation of a pixel on the ground over its level (bright sphere: over the step)

# top | track | frame
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact (free_flight: after the first frame)
center_x_px | px | float | centre of the circle, to the right
center_y_px | px | float | centre of the circle, downwards
radius_px | px | float ± random | radius of the circle
stretch | 1 | float ± random | principal stretch λ
gated_fraction | 1 | float | share of the sectors left out of the fit
residual_rms_px | px | float | rms distance of the edge from the circle
status | – | text | ok, or why something in this row is not measured

# side | track | frame
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact (free_flight: after the first frame)
center_x_px | px | float | centre of the ellipse, to the right
center_y_px | px | float | centre of the ellipse, downwards
radius_px | px | float ± | radius of the sphere of equal volume
stretch | 1 | float ± random | principal stretch λ | rigid sphere
bottom_y_px | px | float ± | lowest point of the ellipse
bottom_local_y_px | px | float ± | lowest point from the bottom of the outline alone | bottom hidden, or free flight
y_b_m | m | float ± random | height of the lowest point above the undisturbed surface (negative below it)
y_b_source | – | text | local or ellipse
separation_y_px | px | float ± | row of the separation line | no cavity yet, or no corner seen
separation_y_m | m | float ± random | height of the separation line | where separation_y_px is
tilt_deg | ° | float ± | tilt of the axis of revolution; positive: the lower pole to the right | nearly round, or rigid
arc_fraction | 1 | float | share of the outline that was visible and used
gated_fraction | 1 | float | share of the visible sectors left out of the fit
residual_rms_px | px | float | rms distance of the edge from the ellipse
status | – | text | ok, or why something in this row is not measured

# cavity | cavity | frame, row, wall
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact
wall | 1 | int | 1 the outer wall, 2 the nested one, …
y_m | m | float | height of the row
left_m | m | float | left wall from the sphere's axis, negative to the left
right_m | m | float | right wall from the sphere's axis

# neck | cavity | frame, neck
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact
neck | 1 | int | number of the neck, from 1, kept in time
y_m | m | float | height of the neck
radius_m | m | float ± | half width of the cavity at the neck

# events | cavity | event
event | – | text | impact, dome_over, second_cavity, pinch_off
index | 1 | int | number of the event of this kind, from 1
t_s | s | float ± | time after impact
y_m | m | float | height where it happens; dome_over: of the rim, from the side view
± | all but dome_over and pinch_off
value | – | text | dome_over: the view; second_cavity: its number; pinch_off: deep_seal, surface_seal or sphere_seal
status | – | text | ok, or why something in this row is not measured

# stretch | stretch | frame
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact
stretch | 1 | float ± | principal stretch λ, top before dome-over, side after it, both where both are valid
source | – | text | top, side or both
stretch_top | 1 | float | λ of the top view at this time
stretch_side | 1 | float | λ of the side view

# periods | stretch | N
period | 1 | int | N, from 1
t_start_s | s | float | upward crossing of the mean about which λ swings, that begins the period (the first: impact)
t_end_s | s | float ± | upward crossing of the mean that ends it; its uncertainty holds that the mean may be 1
t_peak_s | s | float | time of the greatest λ
t_valley_s | s | float | time of the smallest λ
peak_to_peak_s | s | float ± | from this peak to the next
stretch_peak | 1 | float ± | λ_pN
stretch_valley | 1 | float | smallest λ of the period
status | – | text | ok, or why something in this row is not measured

# kinematics | kinematics | frame
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact (free_flight: after the first frame)
x_c_m | m | float | sideways position of the centre
y_b_m | m | float ± random | height of the lowest point
y_c_m | m | float ± random | height of the centre of mass
v_b_m_s | m/s | float ± | velocity of the lowest point, up positive
v_c_m_s | m/s | float ± | velocity of the centre of mass
a_c_m_s2 | m/s² | float ± | acceleration of the centre of mass
status | – | text | ok, or why something in this row is not measured

# model | model | time
t_s | s | float | model time, 0 at the first peak
t_scaled_s | s | float | time after impact: t_peak_1 + ratio · t_s
stretch | 1 | float | model λ
stretch_viscous | 1 | float | model λ_p

# model_fit | model | drop
period_exp_s | s | float | measured free period, first to second peak
period_model_s | s | float | model free period, first to second peak
time_ratio | 1 | float ± | T_exp/T_model
stretch_0 | 1 | float | λ_p1, the model's start
residual_rms | 1 | float | rms of measured minus time-scaled model λ
eps0_dot_1_s | 1/s | float | ε̇₀ of the material used
n | 1 | float | n of the material used
status | – | text | ok, or why something in this row is not measured

# kinematics_model | model | frame
frame | 1 | int | index in the clip, from 0, gaps counted
t_s | s | float | time of mid-exposure after impact
x_c_m | m | float | sideways position of the centre
y_b_m | m | float ± random | height of the lowest point
y_c_m | m | float ± random | height of the centre of mass
v_b_m_s | m/s | float ± | velocity of the lowest point, up positive
v_c_m_s | m/s | float ± | velocity of the centre of mass
a_c_m_s2 | m/s² | float ± | acceleration of the centre of mass
stretch_source | – | text | model, measured or bridge
status | – | text | ok, or why something in this row is not measured

# forces | summary | N (soft) or frame (rigid)
period | 1 | int | N; empty for a rigid sphere
t_mid_s | s | float | middle of the period, or time of the frame
t_mid_over_tp | 1 | float | the same over the drop's own t_p
force_coefficient | 1 | float ± | net force coefficient, as the paper; positive upwards, against the travel
force_coefficient_hydro | 1 | float ± | of the water's force alone: weight and buoyancy taken out; same sign

# summary | summary | drop
drop | – | text | name of the drop
kind | – | text | water_entry, surface_impact or free_flight
condition | – | text | groups repeated drops | not given
repeat | – | text | which repeat | not given
sphere_id | – | text | groups drops of one sphere
rigid | – | text | true or false
diameter_m | m | float | undeformed diameter
density_kg_m3 | kg/m³ | float | density of the sphere | not given
g_inf_pa | Pa | float | G∞ of the material | rigid sphere, or material not given
impact_speed_m_s | m/s | float ± | U₀, measured, positive downwards | free flight, or filmed from the top only
speed_from_height_m_s | m/s | float | √(2 g h), or the speed that was given, as a check | height and speed not given
± | not known
speed_taken_by_air_m_s | m/s | float | what air takes of √(2 g h) at most, with C_D = ½ | height not given
fall_acceleration_m_s2 | m/s² | float ± | acceleration before impact, down positive | free flight, or few frames seen
velocity_m_s | m/s | float ± | free flight: velocity in the middle of the clip, up positive | all but a free flight
acceleration_m_s2 | m/s² | float ± | free flight: constant acceleration, up positive | all but a free flight
froude | 1 | float ± | U₀/√(gD) | where impact_speed_m_s is
bond | 1 | float | ρ_w g D²/σ | no water
± | not known
reynolds | 1 | float ± | ρ_w U₀ D/μ | no water, or impact_speed_m_s empty
stiffness_ratio | 1 | float ± | G∞/(ρ_w U₀²) | rigid sphere, no water, or impact_speed_m_s empty
period_s | s | float ± | free period, first to second peak | rigid sphere, free flight
time_ratio | 1 | float | T_exp/T_model | rigid sphere, free flight, no model, or not told by λ (status of model_fit.csv)
stretch_peak_1 | 1 | float ± | λ_p1 | rigid sphere, free flight, or fewer periods
stretch_peak_2 | 1 | float ± | λ_p2 | rigid sphere, free flight, or fewer periods
stretch_peak_3 | 1 | float ± | λ_p3 | rigid sphere, free flight, or fewer periods
stretch_peak_4 | 1 | float ± | λ_p4 | rigid sphere, free flight, or fewer periods
stretch_peak_5 | 1 | float ± | λ_p5 | rigid sphere, free flight, or fewer periods
t_p_s | s | float ± | time of pinch-off after impact | no side view, no water
y_p_m | m | float | height of pinch-off | where t_p_s is
± | where y_p_m is
pinch_off_cavity | 1 | int | N of the cavity that pinches off | rigid sphere, seal not deep_seal, or t_p_s empty
pinch_off_cavity_source | – | text | measured, or counted beyond the last period seen | where pinch_off_cavity is
seal_type | – | text | deep_seal, surface_seal or sphere_seal | where t_p_s is
diameter_eff_m | m | float ± | D_eff = λ_pN D | sphere_seal, surface_seal, or t_p_s empty
froude_eff | 1 | float ± | U₀/√(g D_eff) | where diameter_eff_m is
tp_u0_over_d | 1 | float ± | t_p U₀/D | where t_p_s is
tp_u0_over_deff | 1 | float ± | t_p U₀/D_eff | where diameter_eff_m is
speed_after_period_m_s | m/s | float ± | U₁, positive downwards | rigid sphere, no side view, no water
delta_u_over_u0 | 1 | float ± | (U₀ − U₁)/U₀ | where speed_after_period_m_s is
velocity_source | – | text | kinematics or kinematics_model | no side view, no water
doubts | – | text | what contradicts what was told, in a few words (in full: warnings) | nothing
frames_measured | 1 | int | frames with status ok
frames_total | 1 | int | frames in the clip
status | – | text | ok, or why something in this row is not measured

# scaling | scaling | relation
relation | – | text | which regression
x | – | text | abscissa
y | – | text | ordinate
slope | 1 | float ± | slope; of a power law its prefactor
slope_low | 1 | float | lower end of the 95 % interval: Student's t on slope_unc (of a power law: on its logarithm)
slope_high | 1 | float | upper end of it
intercept | 1 | float | intercept | through the origin, or a power law
± | through the origin, or a power law
exponent | 1 | float ± | exponent of a power law | all but a power law
exponent_low | 1 | float | lower end of its 95 % interval | all but a power law
exponent_high | 1 | float | upper end of it | all but a power law
dof | 1 | float | degrees of freedom of the Student's t of slope, of a power law of exponent
r_squared | 1 | float | share of the variance explained
residual_scatter | 1 | float | standard deviation of the residuals
n | 1 | int | number of drops
n_conditions | 1 | int | number of conditions among them: repeats of one count once
n_spheres | 1 | int | number of spheres among them: groups of the uncertainty, where there are more than parameters
paper_value | 1 | float | the paper's value | not in the paper
left_out | – | text | drops that the relation is about and that take no part, with the reason | none
doubtful | – | text | drops that take part though something of them is in doubt, with what that is | none
status | – | text | ok, or why something in this row is not measured

# materials | calibrate | material, sphere
material | – | text | key of the material
sphere_id | – | text | sphere it was measured on | not given
diameter_m | m | float | diameter of that sphere
g_inf_pa | Pa | float | G∞
± | not known
g_inf_low_pa | Pa | float | lower end of its 95 % interval: Student's t on g_inf_pa_unc | all but compression
g_inf_high_pa | Pa | float | upper end of it | all but compression
g_t_pa | Pa | float | G_T | from compression
± | not fitted
xi | 1 | float | ξ | from compression
± | not fitted
tau0_pa | Pa | float | τ₀ | from compression
± | not fitted
m | 1 | float | m | from compression
± | not fitted
n | 1 | float ± | n | from compression
n_low | 1 | float | lower end of its 95 % interval: Student's t on n_unc | all but impact
n_high | 1 | float | upper end of it | all but impact
eps0_dot_1_s | 1/s | float ± | ε̇₀ | from compression
eps0_dot_low_1_s | 1/s | float | lower end of its 95 % interval: Student's t on the one of ln ε̇₀ | all but impact
eps0_dot_high_1_s | 1/s | float | upper end of it | all but impact
flow_1_s | 1/s | float | ε̇₀ c_refⁿ with c_ref = .12: known even where ε̇₀ and n are not told apart | all but impact
± | all but impact
correlation | 1 | float | correlation of ln ε̇₀ and n | all but impact
source | – | text | impact, compression or table
status | – | text | ok, or why something in this row is not measured

# compression | calibrate | material, point
material | – | text | key of the material, as in materials.csv
sphere_id | – | text | sphere it was measured on
diameter_m | m | float | diameter of that sphere
zero_m | m | float | displacement at which the plates touch the sphere, fitted
± | not known
displacement_m | m | float | approach of the plates as it was measured
force_n | N | float | force as it was measured
force_model_n | N | float | G∞ D² f((d − zero_m)/D) with the fitted G∞; empty beyond half a diameter

# calibration | calibrate | drop, time
drop | – | text | drop
sphere_id | – | text | sphere, whose drops were fitted together
t_s | s | float | time after impact, from the first peak on
stretch | 1 | float | λ of the calibrated model, with λ₀, λ_p at the peak and the shift of time of this drop
stretch_viscous | 1 | float | λ_p of it
"""
