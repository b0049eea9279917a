"""Who may import whom, read from the source of every file and from what an import really loads."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("ancf", "reference_fe", "compare", "reports")
SOLVERS = {"ancf", "reference_fe"}
CONTRACT = {"compare.scene", "compare.result"}
READERS = {"run", "unpack", "words"}  # of a solver: they know scenes and results

# In ancf a file imports only files above it.
ANCF_ORDER = (
    "shape",
    "image",
    "nurbs",
    "quadrature",
    "columns",
    "packing",
    "parity",
    "products",
    "arcs",
    "recombination",
    "cut",
    "outlined",
    "band",
    "feature",
    "subdomain",
    "mesh",
    "free_edge",
    "layer",
    "wall",
    "material",
    "enhanced",
    "element",
    "quadratic_form",
    "fold",
    "split_form",
    "sharing",
    "rubber",
    "moduli",
    "relaxation",
    "column_products",
    "hyperelastic",
    "assembly",
    "supports",
    "functional",
    "volume_ratio",
    "loads",
    "pressure",
    "rim",
    "obstacle",
    "face",
    "contact_law",
    "contact",
    "system",
    "linear_solver",
    "border",
    "refine",
    "newton",
    "path",
    "integrate",
    "modes",
    "outline_cut",
    "outline",
    "stress",
    "words",
    "unpack",
    "run",
)


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))}


def imported(tree, inside_functions=True):
    """Dotted names that a file imports; a name taken from a package counts as its module where there is one."""
    nodes = ast.walk(tree) if inside_functions else top_level(tree)
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in MODULES else node.module


def top_level(tree):
    """Nodes that run when the file is imported: not in functions, not under TYPE_CHECKING or __main__."""
    waiting = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            continue
        if isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "__name__ == '__main__'"):
            continue
        yield node
        waiting.extend(ast.iter_child_nodes(node))


IMPORTS = {name: set(imported(ast.parse(path.read_text(encoding="utf-8")))) for name, path in MODULES.items()}


def package(name):
    return name.partition(".")[0]


def reachable(start):
    """Our modules that importing one of `start` may load, directly or through others."""
    found, waiting = set(), list(start)
    while waiting:
        name = waiting.pop()
        if name in MODULES and name not in found:
            found.add(name)
            waiting.extend({package(name), *IMPORTS[name]})
    return found


def members(name):
    return [module for module in MODULES if package(module) == name]


def test_there_is_something_to_read():
    assert all(members(name) for name in PACKAGES)
    assert "numpy" in {package(name) for name in IMPORTS["ancf.mesh"]}
    assert "compare.scene" in IMPORTS["ancf.run"]


@pytest.mark.parametrize(("one", "other"), [("ancf", "reference_fe"), ("reference_fe", "ancf")])
def test_the_solvers_never_meet_not_even_through_a_third_module(one, other):
    met = {name for name in reachable(members(one)) if package(name) == other}
    assert met == set()


@pytest.mark.parametrize("solver", sorted(SOLVERS))
def test_a_solver_reads_scene_and_result_only_and_only_where_scenes_are_read(solver):
    for name in members(solver):
        ours = {other for other in IMPORTS[name] if package(other) in PACKAGES and package(other) != solver}
        assert ours <= (CONTRACT if name.removeprefix(f"{solver}.") in READERS else set()), name


@pytest.mark.parametrize("name", members("compare"))
def test_compare_imports_no_solver_and_no_report(name):
    assert not {package(other) for other in IMPORTS[name]} & (SOLVERS | {"reports"})


def test_the_contract_computes_nothing_with_the_solvers_libraries():
    """What both solvers read must not be a place where they could share numerics."""
    for name in sorted(CONTRACT):
        assert not {package(other) for other in IMPORTS[name]} & {"scipy", "numba", "skfem", "gmsh"}, name


OWNERS = {
    "pyvista": {"compare.figures"},
    "vtk": {"compare.figures"},
    "vtkmodules": {"compare.figures"},
    "gmsh": "reference_fe",
    "skfem": {"reports.hard_cases.cook_bricks", *members("reference_fe")},  # a published program's law, rebuilt
    "meshio": {"reference_fe.mesh", "compare.external.exported", "compare.export"},
    "pypardiso": "reference_fe",
    "pymetis": "reference_fe",
    "numba": {"ancf.rubber", *members("reference_fe")},
    "threadpoolctl": {"ancf.run"},
    "pydantic": "compare",
    # codes nobody here wrote, optional
    "exudyn": "compare.external",
    "ngsolve": "compare.external",
}


@pytest.mark.parametrize("library", OWNERS)
def test_a_library_is_imported_only_by_its_owner(library):
    users = {name for name, others in IMPORTS.items() if library in map(package, others)}
    owner = OWNERS[library]
    owned = owner if isinstance(owner, set) else {name for name in MODULES if f"{name}.".startswith(f"{owner}.")}
    assert users <= owned


def test_every_import_is_ours_standard_or_declared():
    declared = {"numpy", "scipy", "rich", "jinja2", "markupsafe", "matplotlib", "PIL", *OWNERS}
    for name, others in IMPORTS.items():
        foreign = {package(other) for other in others} - {*PACKAGES, *sys.stdlib_module_names, "__future__"}
        assert foreign <= declared, name


def test_no_two_files_import_each_other():
    """Files of one package form no ring when they are loaded; imports inside functions may close one."""
    loaded = {
        name: {other for other in imported(ast.parse(path.read_text(encoding="utf-8")), False) if other in MODULES}
        for name, path in MODULES.items()
    }
    done, open_ = set(), []

    def visit(name):
        assert name not in open_, " -> ".join([*open_, name])
        if name not in done:
            open_.append(name)
            for other in sorted(loaded[name]):
                visit(other)
            done.add(open_.pop())

    for name in MODULES:
        visit(name)


def test_in_ancf_a_file_imports_only_files_above_it():
    rank = {f"ancf.{name}": place for place, name in enumerate(ANCF_ORDER)}
    unranked = {name for name in members("ancf") if name != "ancf"} - set(rank)
    assert unranked == set(), "give every file of ancf its place in ANCF_ORDER"
    for name in members("ancf"):
        below = {other for other in IMPORTS[name] if other in rank and name in rank and rank[other] >= rank[name]}
        assert below == set(), name


def loaded_by(statement, whole=False):
    """Top-level modules (whole: all of them) in memory after a statement, in a process of its own."""
    names = "sys.modules" if whole else "{name.partition('.')[0] for name in sys.modules}"
    script = f"{statement}\nimport sys\nprint(*{names})"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


HEAVY = {"pydantic", "numba", "gmsh", "vtk", "vtkmodules", "pyvista", "matplotlib", "skfem", "meshio", "rich", "jinja2"}


# Compiled, at half the cost or less of array expressions: what only a scene of rubber loads.
RUBBER = {f"ancf.{name}" for name in ("rubber", "moduli", "relaxation", "column_products", "hyperelastic")}


def test_importing_ancf_loads_numpy_and_scipy_at_most():
    every = "; ".join(
        f"import {name}" for name in members("ancf") if name.removeprefix("ancf.") not in READERS and name not in RUBBER
    )
    found = loaded_by(f"import ancf; {every}")
    assert not found & HEAVY
    assert not found & {"compare", "reference_fe", "reports"}


def test_running_ancf_adds_pydantic_alone():
    assert loaded_by("import ancf.run") & HEAVY == {"pydantic"}


def test_the_contract_loads_no_solver_and_no_picture():
    found = loaded_by("import compare.scene, compare.result, compare.study, compare.table, compare.gate, compare.cli")
    assert not found & (HEAVY - {"pydantic"} | SOLVERS | {"reports"})


def test_reports_know_gmsh_only_through_the_solver():
    found = loaded_by("import " + ", ".join(members("reports")))
    assert not found & {"gmsh", "vtk", "vtkmodules", "numba"}


def test_every_package_is_installed():
    """An import that works in a checkout works from a wheel too."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    found = {path.parent.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("__init__.py")}
    assert set(stated) == {".".join(folder.parts) for folder in found}


@pytest.mark.parametrize(("solver", "own"), [("ancf", {"rim", "border"}), ("reference_fe", {"rim"})])
def test_a_scene_without_a_rim_loads_none_of_its_code(solver, own):
    """Nothing that a solver loads at import has it, and a scene reads it where it states one."""
    found = loaded_by(f"import {solver}.run; import {solver}.unpack", whole=True)
    assert f"{solver}.system" in found and not found & {f"{solver}.{name}" for name in own}
