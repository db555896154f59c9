!! What the Campbell diagram, critical speeds and the stability limit ask of eigenproblems of whirl over the speed, dense or banded.
!!
!! Shapes in spectra are in coordinates in which their overlaps are those of strain energy.
module razy_rotor_whirl_family
   use razy_core_kinds, only: wp
   use razy_eigen_branches, only: family_t
   use razy_eigen_decay, only: forms_t, in_doubt, judge
   use razy_eigen_spectrum, only: spectrum_t
   implicit none(type, external)
   private

   public :: whirl_family_t

   type, abstract, extends(family_t) :: whirl_family_t
      !> Whether the circulatory matrix acts; whether damping and the skew parts of bearings do.
      logical :: circulatory = .false., damped = .true.
      !> Rigid motions that nothing feels, eigenvalues 0 in pairs: they are left out.
      integer :: untouched = 0
      !> Rigid motions that stay where they are put, eigenvalues 0, one each: they have damping or gyroscopic moments only.
      integer :: resting = 0
      !> Of each entry of a shape (p), the largest undamped frequency, or more, of the part of the machine that it belongs to,
      !> rad/s: no entry of the matrices couples one part with another.
      real(wp), allocatable :: largest(:)
      !> Spectra have all eigenvalues with moduli up to this, rad/s.
      real(wp) :: reach = huge(1.0_wp)
   contains
      procedure(shape_of), deferred :: shape_of
      procedure(to_vector), deferred :: vector_of
      procedure(to_vector), deferred :: shape_from
      procedure(newton), deferred :: newton
      procedure(forms_of), deferred :: forms_of
      procedure :: judge => judge_spectrum
   end type whirl_family_t

   abstract interface
      !> A shape (n) in the coordinates of the unreduced model from one of a spectrum (p).
      function shape_of(self, shape) result(moved)
         import :: whirl_family_t, wp
         implicit none(type, external)
         class(whirl_family_t), intent(in) :: self
         complex(wp), intent(in) :: shape(:)
         complex(wp), allocatable :: moved(:)
      end function shape_of

      !> From shapes of spectra to vectors of Q (`vector_of`) and back (`shape_from`), (p) each.
      function to_vector(self, from) result(to)
         import :: whirl_family_t, wp
         implicit none(type, external)
         class(whirl_family_t), intent(in) :: self
         complex(wp), intent(in) :: from(:)
         complex(wp) :: to(size(from))
      end function to_vector

      !> Q⁻¹ Q_lambda u and Q⁻¹ Q_Omega u (p, 2), Q(lambda, Omega) = lambda² M + lambda (B + Omega G) + K + Omega C with all that
      !> depends on the speed Omega, rad/s. `info` is 0 if Q is regular.
      subroutine newton(self, lambda, speed, u, right, info)
         import :: whirl_family_t, wp
         implicit none(type, external)
         class(whirl_family_t), intent(in) :: self
         complex(wp), intent(in) :: lambda, u(:)
         real(wp), intent(in) :: speed
         complex(wp), intent(out) :: right(:, :)
         integer, intent(out) :: info
      end subroutine newton

      !> The forms of a vector u (p) of Q at the angular speed `speed`, rad/s.
      function forms_of(self, speed, u) result(forms)
         import :: forms_t, whirl_family_t, wp
         implicit none(type, external)
         class(whirl_family_t), intent(in) :: self
         real(wp), intent(in) :: speed
         complex(wp), intent(in) :: u(:)
         type(forms_t) :: forms
      end function forms_of
   end interface

contains

   !> Verdicts of razy_core_verdict on the motions of a spectrum (values), with damping; see `judge` of razy_eigen_decay.
   subroutine judge_spectrum(self, spectrum, verdict)
      class(whirl_family_t), intent(in) :: self
      type(spectrum_t), intent(inout) :: spectrum
      integer, allocatable, intent(out) :: verdict(:)

      type(forms_t) :: forms(size(spectrum%value))
      real(wp) :: largest(size(forms))
      integer :: i

      do i = 1, size(forms)
         largest(i) = self%largest(maxloc(abs(spectrum%shape(:, i)), dim=1))
         if (.not. in_doubt(spectrum%value(i), largest(i))) cycle
         forms(i) = self%forms_of(spectrum%parameter, self%vector_of(spectrum%shape(:, i)))
      end do
      call judge(spectrum%value, largest, forms, self%resting, verdict)
   end subroutine judge_spectrum

end module razy_rotor_whirl_family
