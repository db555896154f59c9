!! How well a Runge–Kutta method knows a gap, its rate, and any linear form of the state after the steps it has made
!! (razy_hybrid_cubic_doubts).
module razy_runge_kutta_known
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_cubic_doubts, only: cubic_defect, within_tolerance
   use razy_runge_kutta_methods_stepper, only: stepper_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: known_t, next_order

   !> Factor on an estimate for what the next order adds, and the error of a step of the classical method in units of Δc.
   real(wp), parameter :: next_order = 2.0_wp, of_change = 384.0_wp/120.0_wp
   !> Steps that differ by a smaller part are equal.
   real(wp), parameter :: alike = 1.0e-6_wp

   type :: known_t
      private
      !> Steps so far; whether they have a tolerance, and which.
      integer(i8) :: steps = 0
      logical :: adaptive = .true.
      real(wp) :: relative = 0.0_wp, absolute = 0.0_wp
      !> Without one: c of each coordinate in the last step and its change, and what changes of c, and second changes over h, add
      !> up to (m each); steps since the motion or the step was another; the step, s.
      real(wp), allocatable :: defect(:), change(:), changes(:), second_changes(:)
      integer :: since = 0
      real(wp) :: h = 0.0_wp
   contains
      procedure :: begin => begin_known
      procedure :: step
      procedure :: more
      procedure :: form
      procedure :: gap
      procedure :: rate
   end type known_t

contains

   !> No step yet, of m coordinates.
   pure subroutine begin_known(self, m)
      class(known_t), intent(inout) :: self
      integer, intent(in) :: m

      self%steps = 0
      self%since = 0
      if (allocated(self%defect)) deallocate (self%defect, self%change, self%changes, self%second_changes)
      allocate (self%defect(m), self%change(m), self%changes(m), self%second_changes(m), source=0.0_wp)
   end subroutine begin_known

   !> A step of the stepper from z; `opening`: the motion before it was another, whose c says nothing, as that of a step of another
   !> length does not.
   pure subroutine step(self, method, stepper, z, opening)
      class(known_t), intent(inout) :: self
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: z(:)
      logical, intent(in) :: opening

      real(wp) :: change, defect
      integer :: i, m

      self%steps = self%steps + 1
      self%adaptive = stepper%adaptive
      self%relative = method%relative_tolerance
      self%absolute = method%absolute_tolerance
      if (self%adaptive) return
      if (opening .or. abs(stepper%h - self%h) > alike*stepper%h) self%since = 0
      self%h = stepper%h
      m = size(self%defect)
      do i = 1, m
         defect = cubic_defect(stepper%h, [z(m + i), stepper%z_end(m + i)], [stepper%dz_start(m + i), stepper%dz_end(m + i)])
         change = defect - self%defect(i)
         if (self%since < 1) change = 0.0_wp
         if (self%since > 1) self%second_changes(i) = self%second_changes(i) + abs(change - self%change(i))/stepper%h
         self%changes(i) = self%changes(i) + abs(change)
         self%change(i) = change
         self%defect(i) = defect
      end do
      self%since = self%since + 1
   end subroutine step

   !> More steps with a tolerance.
   pure subroutine more(self, steps)
      class(known_t), intent(inout) :: self
      integer, intent(in) :: steps

      self%steps = self%steps + steps
   end subroutine more

   !> How well Σ row_i z_i (2m) is known near z.
   pure function form(self, row, z) result(known)
      class(known_t), intent(in) :: self
      real(wp), intent(in) :: row(:), z(:)
      real(wp) :: known

      associate (m => size(self%defect))
         known = self%gap(row(:m), z(:m)) + self%rate(row(m + 1:), z(m + 1:))
      end associate
   end function form

   !> How well Σ w_i y_i (m) is known near y.
   pure function gap(self, w, y) result(known)
      class(known_t), intent(in) :: self
      real(wp), intent(in) :: w(:), y(:)
      real(wp) :: known

      if (self%adaptive) then
         known = self%steps*within_tolerance(w, y, self%relative, self%absolute)
      else
         known = next_order*sum(abs(w)*(abs(self%defect) + of_change*self%changes))
      end if
   end function gap

   !> How well Σ w_i y_i' (m) is known near y': without a tolerance as y, with the next difference of c over h in place of c.
   pure function rate(self, w, v) result(known)
      class(known_t), intent(in) :: self
      real(wp), intent(in) :: w(:), v(:)
      real(wp) :: known

      if (self%adaptive) then
         known = self%steps*within_tolerance(w, v, self%relative, self%absolute)
      else
         known = next_order*sum(abs(w)*(abs(self%change)/self%h + of_change*self%second_changes))
      end if
   end function rate

end module razy_runge_kutta_known
