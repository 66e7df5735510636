"""How good the answer is, as HTML: evidence of optimality, certificates, published values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..terminal import certificate_lines, verdict_lines
from .charts import Curve, Spot, line_chart
from .markup import Markup, grid, joined, paragraphs_of, tag
from .report import Report


def evidence_section(report: Report) -> Markup:
    """What is known of the point from the program alone."""
    result = report.result
    parts: list[Markup] = []
    if "combined" not in result:
        return joined(_evidence_of(report, result))
    for k, own in enumerate(result["tasks"]):
        parts += [tag("h3", f"“{report.parts[k].name}” by itself"), *_evidence_of(report, own)]
    combined = result["combined"]
    if combined["optimality"] is not None:
        parts += [tag("h3", "The combined program"), tag("p", f"Verdict: {combined['optimality']['kind']}.")]
        parts += _active(combined["optimality"])
    return joined(parts)


def _evidence_of(report: Report, result: dict[str, Any]) -> Iterator[Markup]:
    # Rank and starts have their own places on the page.
    rest = {key: value for key, value in result.items() if key != "rank"}
    yield from paragraphs_of(verdict_lines(report.case, {**rest, "starts": {"run": 0}}))
    evidence = result["optimality"]
    if evidence is None:
        return
    yield from _active(evidence)
    if evidence["reduced_hessian_eigenvalues"] and "reached" not in result:
        listed = ", ".join(f"{value:.4g}" for value in evidence["reduced_hessian_eigenvalues"])
        yield tag("p", f"Curvatures along the directions that are left, in scaled variables: {listed}.")


def _active(evidence: dict[str, Any]) -> list[Markup]:
    if not evidence["active"]:
        return [tag("p", "No bound or limit is active.")]
    rows = [[s["name"], s["bound"], f"{s['value']:.7g}", f"{s['multiplier']:.4g}"] for s in evidence["active"]]
    return [grid(["", "side", "value", "multiplier, F per unit"], rows, "Active bounds and limits")]


def certificates(report: Report) -> Markup:
    """What is proved, and how the bound came about."""
    result = report.result
    found: list[tuple[str, dict[str, Any] | None]] = []
    if "combined" in result:
        found += [(f"“{report.parts[k].name}” by itself", own["certificate"]) for k, own in enumerate(result["tasks"])]
        found.append(("The combined program", result["combined"]["certificate"]))
    else:
        found.append(("", result["certificate"]))
    parts: list[Markup] = []
    for name, certificate in found:
        if certificate is None:
            continue
        if name:
            parts.append(tag("h3", name))
        parts += paragraphs_of(certificate_lines(certificate))
        parts += bound_chart(certificate)
    return joined(parts)


def bound_chart(certificate: dict[str, Any]) -> list[Markup]:
    """The bound and the best F known against time."""
    rows = [row for row in certificate["history"] if row[1] is not None and row[2] is not None]
    if len(rows) < 2:
        if not rows:
            return []
        seconds, bound, best = rows[0]
        return [tag("p", f"It took one round: after {seconds:.3g} s the bound was {bound:.7g}, the best F {best:.7g}.")]
    seconds, bounds, best = ([float(row[k]) for row in rows] for k in range(3))
    words = (
        f"The bound goes from {bounds[0]:.7g} after {seconds[0]:.3g} s to {bounds[-1]:.7g} after {seconds[-1]:.3g} s; "
        f"the best F known from {best[0]:.7g} to {best[-1]:.7g}."
    )
    chart = line_chart(
        [Curve(seconds, bounds, "curve", steps=True), Curve(seconds, best, "curve best", steps=True)],
        [Spot(seconds[-1], bounds[-1], "spot", f"bound {bounds[-1]:.7g}")],
        words=words,
        labels=("seconds", "F"),
    )
    return [tag("figure", chart, tag("figcaption", f"Bound (blue) and best point known (orange). {words}"))]


def published(report: Report) -> Markup:
    """What the literature prints beside what is computed here."""
    if report.check is None:
        return Markup("")
    rows = [
        [
            row.published.quantity,
            ", ".join(f"{value:g}" for value in row.published.value),
            ", ".join(f"{value:.7g}" for value in row.computed) or "none",
            row.verdict,
            row.published.source,
            row.published.because or row.rule,
        ]
        for row in report.check.published
    ]
    headers = ["quantity", "published", "computed", "", "where", "how it is known"]
    return grid(headers, rows, "What the literature prints beside what is computed here", id="compared")
