"""What is said of a scene before it is solved: every part of every shipped scene, by the scene and by both solvers."""

import pytest

import ancf.words
import reference_fe.words
from compare.explain import statement
from compare.scene import SHIPPED, load


@pytest.mark.parametrize("name", sorted(path.stem for path in SHIPPED.glob("*.toml")))
def test_every_shipped_scene_is_put_in_words(name):
    """Obstacles with their law, grooves by name or as the tread that they make, whatever their outline."""
    scene = load(name)
    stated = dict(statement(scene))
    for body in scene.obstacles:
        assert f"{body.stiffness:g} N/m" in stated[f"obstacle {body.name}"]
    made = 0 if scene.tread is None else len(scene.grooves)
    assert sum(about.startswith("groove ") for about in stated) == len(scene.grooves) - made
    assert ("tread" in stated) == bool(made)
    for solver, module in (("ancf", ancf.words), ("reference", reference_fe.words)):
        for level in scene.ladder(solver, "full")[:1]:
            modelled, _ = module.words(scene, level)
            assert all(any(groove.name in line for line in modelled) for groove in scene.grooves)
