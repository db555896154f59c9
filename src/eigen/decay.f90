!! Whether motions q = x e^(λt) of M q'' + (B + G) q' + (K + C) q = 0 decay, by energy: K and B symmetric, G and C skew.
!!
!! With λ = μ + i w and the forms m, b, g, k, c of M, B, G, K, C in the shape x the real part of λ m + b + i g + (k + i c)/λ = 0 is
!!
!!     μ (|λ|² m + k) = -(|λ|² b + w c).
!!
!! The right-hand side has no large terms that cancel: an error of x counts as a share of what dampers do, not of the highest
!! frequency, which it would in μ itself.
module razy_eigen_decay
   use razy_core_kinds, only: wp
   use razy_core_verdict, only: is_neutral, is_stable, is_undecided, is_unstable
   use razy_linalg_dense, only: rising_order
   implicit none(type, external)
   private

   public :: forms_t, in_doubt, judge

   !> m, k, b and c of a shape, the sums of the moduli of the terms of b and c, and the most that C has between the shape and one of
   !> the same strain energy.
   type :: forms_t
      real(wp) :: mass = 0.0_wp, stiffness = 0.0_wp, damping = 0.0_wp, cross = 0.0_wp
      real(wp) :: damping_terms = 0.0_wp, cross_terms = 0.0_wp, cross_reach = 0.0_wp
   end type forms_t

   !> Errors of LAPACK's eigenvalues as a part of the largest frequency, some roundings: closer ones are equal.
   real(wp), parameter :: some = 64*epsilon(1.0_wp)

contains

   !> Whether the error of an eigenvalue, which of a double one is the root of rounding of the `largest`, can cover its real part.
   elemental logical function in_doubt(value, largest)
      complex(wp), intent(in) :: value
      real(wp), intent(in) :: largest

      in_doubt = abs(value%re) <= sqrt(epsilon(1.0_wp))*largest
   end function in_doubt

   !> What eigenvalues (values) of a problem say. `largest` (values) is the largest frequency of the part of the machine that moves
   !> in each, 1/s, parts being what no entry of the matrices couples. `forms` (values) are those of what is in doubt; there are
   !> `resting` motions that dampers and gyroscopic moments alone resist, which stay where they are put. Their
   !> eigenvalues become 0, and real parts of other neutral motions.
   subroutine judge(value, largest, forms, resting, verdict)
      complex(wp), intent(inout) :: value(:)
      real(wp), intent(in) :: largest(:)
      type(forms_t), intent(in) :: forms(:)
      integer, intent(in) :: resting
      integer, allocatable, intent(out) :: verdict(:)

      integer, allocatable :: smallest(:)
      real(wp) :: gap(size(value)), near
      integer :: i

      verdict = merge(is_stable, is_unstable, value%re < 0.0_wp)
      do i = 1, size(value)
         ! Eigenvalues that are equal to rounding share their shapes, and what becomes of these; so do those that are so close that
         ! they decay or grow alike, where this is beyond the error that a share of damping has below.
         near = max(some*largest(i), merge(0.5_wp*abs(value(i)%re), 0.0_wp, abs(value(i)%re)*abs(value(i)) > some*largest(i)**2))
         ! A shape turns to neighbours in its own part alone, whose frequencies have the same bound.
         gap(i) = minval(abs(value - value(i)), abs(value - value(i)) > near .and. .not. abs(largest - largest(i)) > 0.0_wp)
      end do
      where (in_doubt(value, largest)) verdict = by_energy(value, largest, gap, forms)
      smallest = rising_order(abs(value))
      verdict(smallest(:min(resting, size(value)))) = is_neutral
      value(smallest(:min(resting, size(value)))) = 0.0_wp
      where (verdict == is_neutral) value%re = 0.0_wp
   end subroutine judge

   elemental integer function by_energy(value, largest, gap, forms) result(verdict)
      complex(wp), intent(in) :: value
      real(wp), intent(in) :: largest, gap
      type(forms_t), intent(in) :: forms

      real(wp) :: resistance, rounding, share, turned

      associate (modulus => abs(value))
         ! Shapes err by the square of the ratio of frequencies; that they turn to neighbours makes no damping negative.
         share = some*(largest/max(modulus, some*largest))**2
         turned = min(share*max(1.0_wp, modulus/gap), 1.0_wp)
         share = min(share, 0.5_wp)
         associate (decay => modulus**2*forms%damping + value%im*forms%cross, &
                    inertia => modulus**2*forms%mass + forms%stiffness, terms => modulus**2*forms%mass + abs(forms%stiffness))
            resistance = modulus**2*forms%damping_terms + abs(value%im)*forms%cross_terms
            rounding = epsilon(1.0_wp)*modulus*terms
            verdict = merge(is_stable, is_unstable, decay > 0.0_wp .eqv. inertia > 0.0_wp)
            associate (error => share*modulus**2*abs(forms%damping) + turned*abs(value%im)*forms%cross_reach &
                       + epsilon(1.0_wp)*resistance + rounding)
               if (abs(decay) <= error .or. abs(inertia) <= share*terms) verdict = is_undecided
            end associate
            ! No damper and nothing that drives touches it: what errs by rounding in a shape has the square of that for energy, of
            ! which a damper that is not stretched by displacements that are large leaves rounding of its terms.
            if (max(modulus**2*abs(forms%damping), epsilon(1.0_wp)*resistance) + abs(value%im)*forms%cross_terms <= rounding &
                .and. inertia > 0.5_wp*terms) verdict = is_neutral
         end associate
      end associate
   end function by_energy

end module razy_eigen_decay
