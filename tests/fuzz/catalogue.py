"""Every kind of input that the fuzzers know."""

from fuzz import boats, gazebo, hulls, meshes, recorded, saved, wires, yaml_files
from fuzz.kind import Kind

KINDS: dict[str, Kind] = {
    kind.name: kind
    for module in (yaml_files, boats, hulls, gazebo, meshes, saved, recorded, wires)
    for kind in module.KINDS
}
