"""The integration study shows what Fig. 4 shows, and judges itself."""

from reports.integration import page, runs
from reports.integration.study import figures, gate_rows, publish
from reports.unit import Measured


def test_three_points_in_subdomains_converge_and_forty_global_ones_do_not():
    """The paper's section 5.2; 1e-4 is what no plot of the norm shows."""
    rows = runs.matrices("Fig. 4", [3, 4], [40])["rows"]
    three, four, forty = (max(row["mass_error"], row["stiffness_error"]) for row in rows)
    assert three < 1e-4 and four < 1e-10 and forty > 1e-4


def test_the_study_publishes_its_figures(tmp_path, monkeypatch):
    monkeypatch.setattr(page, "_gallery", lambda: ((), (), ""))  # pictures take seconds, and have their own tests
    rows = runs.matrices("trapezium", [3, 4], [5])["rows"]
    volume = runs.volumes("trapezium", [1, 2])
    assert volume["volume_error"] < 1e-12 and volume["inertia_error"] < 1e-12
    matrices = [Measured("integration.runs.matrices", {"case": "trapezium"}, "ok", {"rows": rows})]
    volumes = [Measured("integration.runs.volumes", {"case": "trapezium"}, "ok", volume)]
    judged = {figure.name: figure for figure in figures(matrices, volumes)}
    assert judged["tread_volume_error"].met
    assert judged["subdomain_error_4_points"].value is None  # the other polynomial grooves were not run
    told = {row["case"]: row for row in gate_rows(matrices, volumes)}
    assert told["trapezium: mass, subdomain, 4 points"]["value"] == rows[1]["mass_norm"]
    assert told["trapezium: mass, global, 40 points"]["status"] == "no value"  # was not run: the gate refuses it
    failed = [Measured("integration.runs.volumes", {"case": "trapezium"}, "failed: no gmsh")]
    assert figures(matrices, failed)[0].met is None
    path = publish(matrices, volumes, "quick", tmp_path)
    assert "Fig. 4" in path.read_text() and (tmp_path / "integration.json").exists()
