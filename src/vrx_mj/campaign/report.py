"""What a campaign leaves for people: a table as CSV, and a page."""

from dataclasses import replace
from pathlib import Path

from vrx_mj.campaign.compare import Comparison
from vrx_mj.campaign.manifest import Campaign
from vrx_mj.campaign.page import page
from vrx_mj.campaign.results import read_results, read_sketches, write_csv, write_text

__all__ = ["PAGE", "refreshed", "write_report"]

PAGE = "index.html"


def refreshed(campaign: Campaign) -> Campaign:
    """The campaign with the results that are in its folder now."""
    return replace(campaign, results=read_results(campaign.folder, campaign.manifest.plan.cells))


def write_report(campaign: Campaign, comparison: Comparison | None = None) -> Path:
    """Write `results.csv` and the page into the campaign's folder; the path of the page."""
    plan = campaign.manifest.plan
    write_csv(
        campaign.folder / "results.csv", (campaign.results[cell] for cell in plan.cells if cell in campaign.results)
    )
    text = page(campaign, read_sketches(campaign.folder, plan.worlds), comparison)
    write_text(campaign.folder / PAGE, text)
    return campaign.folder / PAGE
