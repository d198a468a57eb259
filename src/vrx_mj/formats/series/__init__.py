"""Worlds in series: the axes files of VRX's world generator, each of which describes many worlds."""
