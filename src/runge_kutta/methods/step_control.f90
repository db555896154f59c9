!! Step control: from the scaled error of a step (1: just allowed) to the factor of the next step.
!!
!! Proportional-integral control, h_new = h safety error^(-1/q + 0.75 beta) previous_error^beta, with q the order of the
!! estimate in h (K. Gustafsson, ACM Trans. Math. Softw. 17 (1991) 533-554; constants of Hairer, Nørsett and Wanner I,
!! II.4, and of Hairer and Wanner II, IV.2).
!! With `predictive` the steps and errors of the last two accepted steps predict the error of the next
!! (Gustafsson, ACM Trans. Math. Softw. 20 (1994) 496-517), which suits stiff problems.
module razy_runge_kutta_methods_step_control
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: factor_of_failure, step_control_t

   type :: step_control_t
      !> q, and the weight of the integral part.
      integer :: order = 5
      real(wp) :: beta = 0.0_wp
      real(wp) :: safety = 0.9_wp
      !> Bounds of the factor from step to step.
      real(wp) :: least = 0.2_wp, most = 10.0_wp
      logical :: predictive = .false.
      !> Memory: error and length of the last accepted step (0: none), and whether the last attempt was rejected.
      real(wp), private :: last_error = 0.0_wp
      real(wp) :: last_h = 0.0_wp
      logical :: rejected = .false.
   contains
      procedure :: forget
      procedure :: accepted
      procedure :: refused
   end type step_control_t

   !> Errors below this are taken for it: an error of nothing predicts no step.
   real(wp), parameter :: least_error = 1.0e-4_wp, tiny_error = 1.0e-30_wp
   !> Factor after a step that gave no number, or whose equations could not be solved.
   real(wp), parameter :: factor_of_failure = 0.25_wp

contains

   !> Forget the steps before.
   pure subroutine forget(self)
      class(step_control_t), intent(inout) :: self

      self%last_h = 0.0_wp
      self%rejected = .false.
   end subroutine forget

   !> Factor after an accepted step `h` with `error` <= 1; `safety` replaces the controller's own (Newton's work).
   pure subroutine accepted(self, h, error, safety, factor)
      class(step_control_t), intent(inout) :: self
      real(wp), intent(in) :: h, error, safety
      real(wp), intent(out) :: factor

      real(wp) :: power, seen

      seen = max(error, tiny_error)
      if (self%predictive) then
         factor = safety*seen**(-1.0_wp/self%order)
         if (self%last_h > 0.0_wp) factor = min(factor, safety*(h/self%last_h)*(self%last_error/seen**2)**(1.0_wp/self%order))
      else
         power = (0.75_wp*self%beta - 1.0_wp/self%order)*log(seen)
         if (self%last_h > 0.0_wp) power = power + self%beta*log(self%last_error)
         factor = safety*exp(power)
      end if
      factor = min(max(factor, self%least), self%most)
      if (self%rejected) factor = min(factor, 1.0_wp)
      self%last_error = max(error, merge(1.0e-2_wp, least_error, self%predictive))
      self%last_h = h
      self%rejected = .false.
   end subroutine accepted

   !> Factor after a rejected step with `error` > 1.
   pure subroutine refused(self, error, safety, factor)
      class(step_control_t), intent(inout) :: self
      real(wp), intent(in) :: error, safety
      real(wp), intent(out) :: factor

      factor = min(max(safety*error**(-1.0_wp/self%order), self%least), self%safety)
      self%rejected = .true.
   end subroutine refused

end module razy_runge_kutta_methods_step_control
