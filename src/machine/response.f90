!! What a machine whose contacts keep a chosen state does in the long run under each tone of its excitation, without integrating:
!!
!!     (-ω² M + i ω B + K) q = F - Σ_j (k_j + i ω b_j) w_j e_j,
!!
!! K and B with the contacts' slopes k_j, b_j, and e_j their excitation. B may be of any form (gyroscopic), K too (circulatory).
module razy_machine_response
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_linalg_band_matrix, only: band_t, complex_band_lu_t, dense_band, find_band
   use razy_machine_linearised, only: linear_ok, linearise
   use razy_machine_machine, only: machine_t, observe_contact_force, observe_in_plane
   implicit none(type, external)
   private

   public :: find_response

contains

   !> Phasors of the observables, Re(value e^{iωt}), `value` (observables, tones); not a number where the matrix is singular, and
   !> for the distance in a ring, which is not linear.
   !> `status` and `culprit` are those of `linearise`, whose states `contacts` is one of.
   subroutine find_response(machine, contacts, value, status, culprit)
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: contacts
      complex(wp), allocatable, intent(out) :: value(:, :)
      integer, intent(out) :: status, culprit

      type(band_t) :: bands(3)
      type(complex_band_lu_t) :: factor
      complex(wp), allocatable :: force(:, :), ordered(:, :)
      complex(wp) :: spring(size(machine%contact))
      real(wp), allocatable :: damping(:, :), slope(:, :), stiffness(:, :)
      real(wp) :: omega
      integer, allocatable :: order(:)
      integer :: i, info, j, t, width

      allocate (value(size(machine%observable), size(machine%tone)))
      call linearise(machine, contacts, stiffness, damping, status, culprit, slope)
      if (status /= linear_ok) return
      call find_band(machine%mass, damping, stiffness, order, width)
      bands = [dense_band(stiffness, order, width), dense_band(damping, order, width), dense_band(machine%mass, order, width)]
      do t = 1, size(machine%tone)
         omega = machine%tone(t)%omega
         spring = cmplx(slope(1, :), omega*slope(2, :), wp)
         force = machine%harmonic_load(:, t:t)
         do j = 1, size(machine%contact)
            force(:, 1) = force(:, 1) - spring(j)*machine%contact(j)%error(t)*machine%contact(j)%w
         end do
         call factor%factor(bands(1), bands(2), bands(3), cmplx(0.0_wp, omega, wp), info)
         if (info == 0) then
            ordered = force(order, :)
            call factor%solve(ordered)
            force(order, :) = ordered
         else
            force = ieee_value(1.0_wp, ieee_quiet_nan)
         end if
         do i = 1, size(machine%observable)
            associate (seen => machine%observable(i))
               if (seen%kind == observe_in_plane) then
                  value(i, t) = ieee_value(1.0_wp, ieee_quiet_nan)
               else if (seen%kind == observe_contact_force) then
                  associate (contact => machine%contact(seen%contact))
                     value(i, t) = contact%force_sign*spring(seen%contact)*(sum(contact%w*force(:, 1)) + contact%error(t))
                  end associate
               else
                  value(i, t) = sum(cmplx(seen%on_displacement, omega*seen%on_velocity, wp)*force(:, 1)) + seen%error(t)
               end if
            end associate
         end do
      end do
   end subroutine find_response

end module razy_machine_response
