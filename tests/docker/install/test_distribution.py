"""What a user of pip gets: sdist and wheel, an empty environment, ``slewline demo``.

Not among the ordinary tests: it takes minutes and the package index. ``.ci/run`` runs it.
"""

from __future__ import annotations

import tarfile
import zipfile

from planner_core.solvers.registry import SOLVERS
from tests.docker.install.conftest import ROOT, Demonstrated, Distribution, User, run

PACKAGES = {"migrations", "planner_core", "service", "slewline"}


def test_both_hold_every_package_and_its_data_and_no_tests(dist: Distribution) -> None:
    with tarfile.open(dist.sdist) as archive:
        in_sdist = {name.partition("/")[2] for name in archive.getnames()}
    in_wheel = set(zipfile.ZipFile(dist.wheel).namelist())
    ours = {name for name in in_wheel if ".dist-info/" not in name}
    assert {name.partition("/")[0] for name in ours} == PACKAGES
    assert ours <= in_sdist
    tracked = run("git", "ls-files", "-z", *sorted(PACKAGES), cwd=ROOT).split("\0")
    needed = {name for name in tracked if name and not name.endswith("README.md")}
    assert needed - {"planner_core/data/make_eop.py"} <= ours


def test_the_client_and_the_core_are_imported_by_the_products_name(user: User) -> None:
    said = user.run(
        "python", "-c",
        "import slewline, sys; print('numpy' in sys.modules, slewline.Client('http://h'));"
        "from slewline import core; print(core.plan_scenario.__name__)",
    )  # fmt: skip
    assert said.splitlines() == ["False Client('http://h')", "plan_scenario"]


def test_the_demo_runs_and_runs_again_with_nothing_left_to_compile(
    demonstrated: Demonstrated,
) -> None:
    for said in (demonstrated.said, demonstrated.said_again):
        valid = {line.split()[0] for line in said.splitlines() if line.endswith(" valid")}
        assert valid == set(SOLVERS)
    assert "Compiling" in demonstrated.said
    assert "Compiling" not in demonstrated.said_again
    written = (demonstrated.user.folder / "demo-output").glob("timeline-*")
    assert {path.name for path in written} == {f"timeline-{solver}.json" for solver in SOLVERS}
