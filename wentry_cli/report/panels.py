"""All panels in the order of the paper, then those of single drops."""

from __future__ import annotations

from wentry_cli.report.calibration_panels import surface_impacts
from wentry_cli.report.campaign import Campaign
from wentry_cli.report.compression_panel import compression
from wentry_cli.report.drop_sheets import drop_sheets
from wentry_cli.report.entry_panels import bottom_position, stretch_in_time
from wentry_cli.report.force_panels import force_coefficients
from wentry_cli.report.free_flight_panels import free_flights
from wentry_cli.report.oscillation_panels import oscillation_period, stretch_model, stretch_peaks
from wentry_cli.report.panel import NotDrawn, Panel
from wentry_cli.report.pinch_off_panels import pinch_off_diameter, pinch_off_effective
from wentry_cli.report.velocity_panels import velocity_change, velocity_panels

Made = list[Panel | NotDrawn]


def campaign_panels(campaign: Campaign) -> Made:
    """Make every panel of the paper, or the reason why it is not drawn: one reason where no drop enters water."""
    entries = entry_panels(campaign)
    if not campaign.of("water_entry") and not any(isinstance(panel, Panel) for panel in entries):
        entries = [NotDrawn("3–8", "panels of an entry into water", "no drop here is one")]
    return [*entries, compression(campaign), *surface_impacts(campaign)]


def entry_panels(campaign: Campaign) -> Made:
    """Make the panels of the paper that show entries into water."""
    return [
        bottom_position(campaign),
        stretch_in_time(campaign),
        oscillation_period(campaign),
        stretch_peaks(campaign),
        stretch_model(campaign),
        pinch_off_diameter(campaign),
        pinch_off_effective(campaign),
        *velocity_panels(campaign),
        velocity_change(campaign),
        force_coefficients(campaign),
    ]


def drop_panels(campaign: Campaign) -> Made:
    """Make the panels of single drops: a sheet for each, and the path of each free flight."""
    return [*free_flights(campaign), *drop_sheets(campaign)]
