// SPDX-License-Identifier: GPL-2.0-only
#pragma once

#ifndef EVP_FAULT
#define EVP_FAULT NO_FAULT
#endif

namespace EVP {

/// What a build with -DEVP_FAULT=NAME does wrong, so that tests can be seen to notice: tests/maintain/faults.py.
enum Fault {
  NO_FAULT,
  QUARTER_STIFFNESS,        ///< a quarter of the stiffness in compute evp/dt
  NO_GAMMA_IN_DT,           ///< gamma left out of compute evp/dt
  ONE_MASS,                 ///< one mass for all atoms in compute evp/dt
  NO_DT_WARNING,            ///< no warning of a timestep above the limit
  NO_DISPLACEMENT_LIMIT,    ///< no limit of displacement per step in fix dt/evp
  NO_OVERLAP_WARNING,       ///< no warning of overlaps
  NO_COINCIDENCE_CHECK,     ///< no check for coincident centres
  HALF_CARRIED,             ///< half of the force carried into the second regime
  HALF_THRESHOLD,           ///< force and energy carried over from half of xi_s
  E2_SHORT,                 ///< e2 less by a tenth
  EXPONENTS_4_2,            ///< exponents 4 2 in place of 2 1
  FIRST_POWERS,             ///< powers of the first regime in both regimes
  DLIM_LONG,                ///< dlim larger by a tenth
  NONZERO_AT_DLIM,          ///< energy not zero at dlim
  GAMMA_LONG,               ///< gamma larger by 1e-6
  VX_OF_PARTNER_ONLY,       ///< damping by v_x of one atom only
  NO_DAMPING_ALONG_Y,       ///< no implicit damping along y
  NO_ROTATION,              ///< implicit damping along the old direction of a rotating pair
  ONE_PASS,                 ///< rotation of pairs from the last step only
  NO_IMPLICIT,              ///< no implicit damping
  NULL_IS_PRESCRIBED,       ///< NULL components of fix move enter as prescribed
  NO_IMAGE_VELOCITIES,    ///< remap v: velocities of periodic images not corrected in implicit damping
  NO_WRAPPED_ENERGY,         ///< remap v: kinetic energy of wrapped atoms not in the energy balance
  NO_WORK_OF_BOX,            ///< remap v: no work of the box by implicit damping
  HALF_DISSIPATION,          ///< half of the dissipation of implicit damping in the energy balance
  KINETIC_SHORT,             ///< kinetic energy short by a fifth in the energy balance
  NO_NEW_CONTACTS,           ///< new contacts not in the energy balance
  NO_LOST_BONDS,             ///< lost bonds not in the energy balance
  NO_FLOW_IN_COMPRESSION,    ///< no flow of bonds in compression
  CONTACTS_FLOW_IN_TENSION,    ///< contacts flow in tension
  NO_BOND_BREAKS,              ///< no bond breaks
  NO_FLOW_OF_MISSING,     ///< bonds that leave the neighbor list do not flow up to their cutoff
  HISTORY_AT_ONE_ATOM,    ///< the history of a pair is kept at one atom only
  STOPPED_FLOWS,    ///< a minimization that stops at its maximum number of iterations leaves its flow
  BODIES_BONDED,                   ///< two bodies are bonded where they are close at the start
  BODIES_ATTRACT,                  ///< attraction between two bodies
  CONTACTS_FLOW_BETWEEN_BODIES,    ///< contacts between two bodies flow
  HALF_VOLUME_FORCE                ///< half of the forces of the volume energy
};

constexpr bool fault(Fault asked)
{
  return asked == EVP_FAULT;
}

}    // namespace EVP
