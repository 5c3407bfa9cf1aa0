"""How a bent region of the position, ``kernels/filters/bent_region.py``, stands in the telemetry."""

REGION_COLUMNS = {
    "region_direction_rad": "rad",
    "region_sigma_m": "m",
    "region_bend_along_m": "m",
    "region_bend_across_m": "m",
    "region_across_var_m2": "m^2",
    "region_across_slope_m2": "m^2",
    "region_across_curve_m2": "m^2",
}
"""In the order of the kernel, with their units; the region is about the estimate."""
