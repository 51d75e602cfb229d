// SPDX-License-Identifier: GPL-2.0-only
//
// Where the LAMMPS releases differ: the only file that knows. There is no version macro: of two
// overloads the compiler keeps the one whose calls exist, and prefers the newer (int before long).

#ifndef EVP_LAMMPS_COMPAT_H
#define EVP_LAMMPS_COMPAT_H

#include "comm.h"
#include "compute.h"
#include "fix.h"
#if __has_include("neigh_request.h")    // an installed LAMMPS leaves it out, and needs it not
#include "neigh_request.h"
#endif
#include "neighbor.h"
#include "output.h"
#include "pair.h"

namespace EVP {
namespace compat {

  namespace detail {
    // NeighConst::REQ_FULL | NeighConst::REQ_OCCASIONAL, names that 29Sep2021 does not have
    constexpr int FULL_OCCASIONAL = (1 << 0) | (1 << 4);

    template <class N, class Owner>
    auto request_full(N *neighbor, Owner *owner, int, int)
        -> decltype(neighbor->add_request(owner, FULL_OCCASIONAL), void())
    {
      neighbor->add_request(owner, FULL_OCCASIONAL);
    }
    template <class N, class Owner>
    auto request_full(N *neighbor, Owner *owner, int instance, long)
        -> decltype(neighbor->requests[0]->full, void())
    {
      const int index = neighbor->request(owner, instance);    // this call moves the array
      auto *request = neighbor->requests[index];
      request->pair = request->half = 0;
      request->fix = request->full = request->occasional = 1;
    }

    // 29Sep2021 names the owner's kind in the call; the other overload then has no such member
    template <class C, class Owner>
    auto forward(C *comm, Owner *owner, int) -> decltype(comm->forward_comm(owner))
    {
      comm->forward_comm(owner);
    }
    template <class C>
    auto forward(C *comm, LAMMPS_NS::Compute *owner, long)
        -> decltype(comm->forward_comm_compute(owner))
    {
      comm->forward_comm_compute(owner);
    }
    template <class C>
    auto forward(C *comm, LAMMPS_NS::Fix *owner, long) -> decltype(comm->forward_comm_fix(owner))
    {
      comm->forward_comm_fix(owner);
    }
    template <class C>
    auto forward(C *comm, LAMMPS_NS::Pair *owner, long) -> decltype(comm->forward_comm_pair(owner))
    {
      comm->forward_comm_pair(owner);
    }
    template <class C, class Owner>
    auto reverse(C *comm, Owner *owner, int) -> decltype(comm->reverse_comm(owner))
    {
      comm->reverse_comm(owner);
    }
    template <class C>
    auto reverse(C *comm, LAMMPS_NS::Compute *owner, long)
        -> decltype(comm->reverse_comm_compute(owner))
    {
      comm->reverse_comm_compute(owner);
    }
    template <class C>
    auto reverse(C *comm, LAMMPS_NS::Fix *owner, long) -> decltype(comm->reverse_comm_fix(owner))
    {
      comm->reverse_comm_fix(owner);
    }
    template <class O> auto reset_dt(O *output, int) -> decltype(output->reset_dt())
    {
      output->reset_dt();
    }
    // 29Sep2021: output counts steps only
    template <class O> void reset_dt(O *, long) {}
  }    // namespace detail

  inline LAMMPS_NS::Fix *base_of(LAMMPS_NS::Fix *fix)
  {
    return fix;
  }
  inline LAMMPS_NS::Compute *base_of(LAMMPS_NS::Compute *compute)
  {
    return compute;
  }

  inline LAMMPS_NS::Pair *base_of(LAMMPS_NS::Pair *pair)
  {
    return pair;
  }

  /// The half neighbor list of a pair style, by the call that every release has.
  inline void request_half_list(LAMMPS_NS::Neighbor *neighbor, LAMMPS_NS::Pair *pair, int instance)
  {
    neighbor->request(pair, instance);
  }

  /// A full neighbor list of a fix, built on demand; the user should check that it is.
  inline void request_full_list(LAMMPS_NS::Neighbor *neighbor, LAMMPS_NS::Fix *fix, int instance)
  {
    detail::request_full(neighbor, fix, instance, 0);
  }

  /// Values of a fix, compute or pair style from owned atoms to their ghosts.
  template <class Owner> void forward_comm(LAMMPS_NS::Comm *comm, Owner *owner)
  {
    detail::forward(comm, base_of(owner), 0);
  }

  /// Values of a fix or compute from ghosts summed into the owned atoms.
  template <class Owner> void reverse_comm(LAMMPS_NS::Comm *comm, Owner *owner)
  {
    detail::reverse(comm, base_of(owner), 0);
  }

  /// Output that is scheduled by time learns of a new step.
  inline void reset_dt(LAMMPS_NS::Output *output)
  {
    detail::reset_dt(output, 0);
  }

}    // namespace compat
}    // namespace EVP

#endif
