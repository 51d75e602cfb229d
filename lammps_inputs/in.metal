# SPDX-License-Identifier: GPL-2.0-only
# A cylinder of aluminium 2024-T351 is pulled at 50/s to a strain of 2 % and goes back by 0.52 %: what is left is permanent.
#   lmp -in in.specimen           makes specimen.data: length 0.05 m, radius 0.02 m
#   lmp -in in.metal              writes metal.csv; to expect: 392 MPa at 2 %, and no stress at 1.48 %
# The flow curve has 359 MPa there: grips hold the width of a body that is as short as this one, see doc/metals.md.
units           si
atom_style      sphere
boundary        s s s
read_data       specimen.data
set             group all density 4728                  # 2770 kg/m3 over the solid fraction, 0.5859
neighbor        3.6e-4 bin                              # 6 % of the largest diameter
# material: the row of potentials/metals.evp, which is scaled with the bonds of this body; bonds flow and harden
pair_style      evp/lj contact join plasticity isotropic
pair_coeff      * * 112.684 8 4 4.22565 8 4 0.00250348 0 1.5 spacing 0.00485024 coordination 15.03 kv 1680.64 &
                flow 0 1 0.0005 1.12129 0.001 1.15352 0.002 1.19432 0.005 1.26534 0.01 1.33585 0.02 1.42511 0.05 1.58049 &
                0.1 1.73477 0.2 1.93004 0.3 2.06752 0.45 2.22533 0.7 2.42393 1 2.60753 1.5 2.84514 2 3.03476 yield 2.65e+08 density 2770
fix             bonds all evp/bonds
fix             volume all evp/volume row
# grips within 0.1 L of the ends; strain of the grips, and stress from the force on them
region          left block INF 0.005 INF INF INF INF
region          right block 0.045 INF INF INF INF INF
group           left region left
group           right region right
group           free subtract all left right
fix             left left nve/noforce
fix             right right nve/noforce
fix             free free nve
timestep        2e-7                            # less than half of what compute evp/dt gives
variable        strain equal (xcm(right,x)-xcm(left,x))/0.04-$((xcm(right,x)-xcm(left,x))/0.04:%.16g)
variable        stress equal (fcm(left,x)-fcm(right,x))/2/(PI*0.02^2)
fix             csv all print 20 "$(v_strain:%.6g),$(v_stress:%.6g)" file metal.csv screen no title strain,stress
thermo          200
thermo_style    custom step v_strain v_stress f_bonds[2]
thermo_modify   colname v_strain strain colname v_stress stress colname f_bonds[2] flowed
# pull, then back: body and grips turn with the velocities of uniform stretching, 50/s times 0.02 m at a grip
velocity        all ramp vx -1 1 x 0.005 0.045
run             2000 post no
velocity        all ramp vx 2 -2 x 0.005 0.045 sum yes
run             535 post no
