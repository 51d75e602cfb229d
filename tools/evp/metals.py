# SPDX-License-Identifier: GPL-2.0-only
"""The metals that are shipped: Johnson-Cook's constants, what is known of each, and the point that its second stress is taken from."""

from typing import NamedTuple

from .johnson_cook import JohnsonCook, from_handbook

BALLISTICS = "Johnson and Cook, 7th Int. Symp. on Ballistics, The Hague, 1983"


class Metal(NamedTuple):
    """law: its curve; density [kg/m3]; poisson: of the metal, for the page; strain: of the second stress, negative in compression."""

    title: str
    law: JohnsonCook
    density: float
    poisson: float
    strain: float
    source: str


METALS = {
    "aluminium_1100O": Metal(
        "pure aluminium, 1100-O", from_handbook(69e9, 34e6, 90e6), 2710.0, 0.33, 0.05,
        "ASM Handbook vol. 2: 1100-O has a 0.2 % yield stress of 34 MPa, an ultimate stress of 90 MPa; power law through both, necking by Considere"),
    "aluminium_2024T351": Metal("aluminium 2024-T351", JohnsonCook(73e9, 265e6, 426e6, 0.34), 2770.0, 0.33, 0.05, BALLISTICS),
    "copper_OFHC": Metal("OFHC copper", JohnsonCook(124e9, 90e6, 292e6, 0.31), 8960.0, 0.34, 0.05, BALLISTICS),
    "copper_taylor": Metal(
        "copper of the Taylor benchmark", JohnsonCook(117e9, 400e6, 100e6, 1.0), 8930.0, 0.35, -0.1,
        "The usual benchmark of a copper bar of 32.4 x 6.4 mm at 227 m/s: yield 400 MPa, linear hardening 100 MPa"),
    "steel_4340": Metal("4340 steel", JohnsonCook(205e9, 792e6, 510e6, 0.26), 7830.0, 0.29, -0.1, BALLISTICS + "; E of handbooks"),
}
