!! What a machine whose contacts keep a chosen state does in the long run under each tone of its excitation, without integrating:
!!
!!     (-ω² M + i ω B + K) q = F - Σ_j (k_j + i ω b_j) w_j e_j,
!!
!! K and B with the contacts' slopes k_j, b_j, and e_j their excitation. B may be of any form (gyroscopic), K too (circulatory).
!!
!! Free motions Phi, K Phi = 0 by structure, are followed apart: slow ones are large, and the rounding of K would hold them. With
!! q = Phi a + p, where p is 0 at as many coordinates as there are motions, and D = -ω² M + i ω B,
!!
!!     D Phi a + (D + K + i S) p = f,   p = 0 there,
!!
!! S being a spring at each of these coordinates, which p does not stretch: a matrix in the same band that no free motion and no
!! resonance of the held machine makes singular.
module razy_machine_response
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_linalg_band_matrix, only: band_t, complex_band_lu_t, dense_band, find_band
   use razy_linalg_lapack, only: zgesv
   use razy_linalg_null_space, only: complement_of, rank_bound
   use razy_machine_free_motions, only: linear_free_motions
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
      complex(wp), allocatable :: drift(:), force(:, :), ordered(:, :)
      complex(wp) :: spring(size(machine%contact))
      real(wp), allocatable :: damping(:, :), feeling(:, :), motion(:, :), momentum(:, :), slope(:, :), stiffness(:, :)
      real(wp) :: omega
      integer, allocatable :: order(:), pin(:)
      integer :: i, info, j, t, width

      allocate (value(size(machine%observable), size(machine%tone)))
      call linearise(machine, contacts, stiffness, damping, status, culprit, slope)
      if (status /= linear_ok) return
      call free_motions(machine, slope, damping, motion, feeling)
      momentum = matmul(machine%mass, motion)
      pin = pins_of(motion)
      call find_band(machine%mass, damping, stiffness, order, width)
      do t = 1, size(machine%tone)
         omega = machine%tone(t)%omega
         spring = cmplx(slope(1, :), omega*slope(2, :), wp)
         force = reshape([machine%harmonic_load(:, t), cmplx(-omega**2*momentum, omega*feeling, wp)], [size(order), 1 + size(pin)])
         do j = 1, size(machine%contact)
            force(:, 1) = force(:, 1) - spring(j)*machine%contact(j)%error(t)*machine%contact(j)%w
         end do
         bands = [dense_band(stiffness, order, width), dense_band(damping, order, width), dense_band(machine%mass, order, width)]
         do j = 1, size(pin)
            associate (held => bands(2)%entry(width + 1, findloc(order, pin(j), dim=1)))
               held = held + abs(stiffness(pin(j), pin(j)))/omega + omega*machine%mass(pin(j), pin(j))
            end associate
         end do
         call factor%factor(bands(1), bands(2), bands(3), cmplx(0.0_wp, omega, wp), info)
         if (info == 0) then
            ordered = force(order, :)
            call factor%solve(ordered)
            force(order, :) = ordered
            call solve_small(force(pin, 2:), force(pin, 1), drift, info)
            force(:, 1) = force(:, 1) - matmul(force(:, 2:), drift)
         end if
         if (info /= 0) then
            force = ieee_value(1.0_wp, ieee_quiet_nan)
            drift = force(pin, 1)
         end if
         do i = 1, size(machine%observable)
            associate (seen => machine%observable(i))
               if (seen%kind == observe_in_plane) then
                  value(i, t) = ieee_value(1.0_wp, ieee_quiet_nan)
               else if (seen%kind == observe_contact_force) then
                  associate (contact => machine%contact(seen%contact))
                     value(i, t) = contact%force_sign*spring(seen%contact)*(seen_of(contact%w) + contact%error(t))
                  end associate
               else
                  value(i, t) = seen_of(seen%on_displacement) + (0.0_wp, 1.0_wp)*omega*seen_of(seen%on_velocity) + seen%error(t)
               end if
            end associate
         end do
      end do

   contains

      !> A row of the displacements; of a free motion that does not change it nothing is left but rounding.
      pure complex(wp) function seen_of(row)
         real(wp), intent(in) :: row(:)

         real(wp) :: change(size(motion, 2))

         change = matmul(row, motion)
         where (abs(change) <= rank_bound*matmul(abs(row), abs(motion))) change = 0.0_wp
         seen_of = sum(row*force(:, 1)) + sum(change*drift)
      end function seen_of

   end subroutine find_response

   !> Orthonormal free motions (n, r) of the machine, and B times these, 0 where they stretch no damper.
   subroutine free_motions(machine, slope, damping, motion, feeling)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: slope(:, :), damping(:, :)
      real(wp), allocatable, intent(out) :: motion(:, :), feeling(:, :)

      real(wp), allocatable :: of_stiffness(:, :), rigid(:, :)

      call linear_free_motions(machine, slope, of_stiffness, rigid)
      motion = reshape([rigid, matmul(of_stiffness, complement_of(matmul(transpose(of_stiffness), rigid)))], shape(of_stiffness))
      feeling = matmul(damping, motion)
      feeling(:, :size(rigid, 2)) = 0.0_wp
   end subroutine free_motions

   !> Coordinates (r) whose rows of the orthonormal columns `motion` (n, r) are independent, the largest of what is left each time.
   pure function pins_of(motion) result(pin)
      real(wp), intent(in) :: motion(:, :)
      integer :: pin(size(motion, 2))

      real(wp) :: left(size(motion, 1), size(motion, 2))
      integer :: k

      left = motion
      do k = 1, size(pin)
         pin(k) = maxloc(norm2(left, dim=2), dim=1)
         associate (row => left(pin(k), :)/norm2(left(pin(k), :)))
            left = left - spread(matmul(left, row), 2, size(row))*spread(row, 1, size(left, 1))
         end associate
      end do
   end function pins_of

   !> x = A⁻¹ b of order r; `info` is LAPACK's: 0 is success.
   subroutine solve_small(a, b, x, info)
      complex(wp), intent(in) :: a(:, :), b(:)
      complex(wp), allocatable, intent(out) :: x(:)
      integer, intent(out) :: info

      complex(wp) :: factor(size(b), size(b))
      integer :: pivot(size(b))

      factor = a
      x = b
      call zgesv(size(b), 1, factor, max(1, size(b)), pivot, x, max(1, size(b)), info)
   end subroutine solve_small

end module razy_machine_response
