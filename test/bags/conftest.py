import pytest
from bag_making import Recorded, write_run


@pytest.fixture(scope="package")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """A bag of 300 steps, which tests must not change, and the written bytes by topic."""
    directory = tmp_path_factory.mktemp("recorded") / "bag"
    return directory, write_run(directory, 300)
