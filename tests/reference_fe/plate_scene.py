"""A scene that tests change: the soft plain cantilever, coarse."""

PLAIN = {
    "name": "plate",
    "title": "plate",
    "surface": {"kind": "rectangle", "length": 1.0, "width": 1.0},
    "thickness": 0.05,
    "material": {"kind": "svk", "youngs_modulus": 2e6, "density": 2000.0},
    "supports": [{"kind": "clamp", "edge": "x0"}],
    "loads": [{"kind": "point", "at": [1.0, 1.0], "force": [0.0, 0.0, -50.0], "history": [[0.0, 0.0], [1.0, 1.0]]}],
    "probes": [{"name": "P", "at": [1.0, 1.0, 0.0]}],
    "analysis": {"kind": "dynamic", "until": 1.0, "every": 0.1},
    "reference": {"levels": [{"size": 0.4, "time_step": 0.1}]},
}
