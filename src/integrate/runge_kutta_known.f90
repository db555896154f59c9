!! How well a step of a Runge–Kutta method knows a gap, its rate, and any linear form of the state (razy_integrate_doubts).
module razy_integrate_runge_kutta_known
   use razy_core_kinds, only: wp
   use razy_integrate_doubts, only: between_known_ends, within_tolerance
   use razy_integrate_field, only: field_t
   use razy_integrate_stepper, only: stepper_t
   use razy_machine_method, only: method_t
   implicit none(type, external)
   private

   public :: known_form, known_gap, known_rate

contains

   !> How well Σ row_i z_i (2m) is known in a step that starts at z.
   pure function known_form(row, method, stepper, z) result(known)
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: row(:), z(:)
      real(wp) :: known

      real(wp) :: of_y
      integer :: i, m

      if (stepper%adaptive) then
         known = within_tolerance(row, z, method%relative_tolerance, method%absolute_tolerance)
         return
      end if
      m = size(z)/2
      known = 0.0_wp
      do i = 1, m
         of_y = between_known_ends(stepper%h, [z(m + i), stepper%z_end(m + i)], [stepper%dz_start(m + i), stepper%dz_end(m + i)])
         known = known + (abs(row(i)) + abs(row(m + i))*4/stepper%h)*of_y
      end do
   end function known_form

   !> How well s of contact j is known in a step that starts at z.
   function known_gap(field, method, stepper, j, z) result(known)
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      real(wp) :: known

      associate (m => field%m, w => field%w(:, j))
         if (stepper%adaptive) then
            known = within_tolerance(w, z(:m), method%relative_tolerance, method%absolute_tolerance)
         else
            known = between_known_ends(stepper%h, [dot_product(w, z(m + 1:)), dot_product(w, stepper%z_end(m + 1:))], &
                                       [dot_product(w, stepper%dz_start(m + 1:)), dot_product(w, stepper%dz_end(m + 1:))])
         end if
      end associate
   end function known_gap

   !> The same of s': without a tolerance a change of s over a quarter of the step.
   function known_rate(field, method, stepper, j, z) result(known)
      type(field_t), intent(inout) :: field
      type(method_t), intent(in) :: method
      type(stepper_t), intent(in) :: stepper
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)
      real(wp) :: known

      if (stepper%adaptive) then
         known = within_tolerance(field%w(:, j), z(field%m + 1:), method%relative_tolerance, method%absolute_tolerance)
      else
         known = 4*known_gap(field, method, stepper, j, z)/stepper%h
      end if
   end function known_rate

end module razy_integrate_runge_kutta_known
