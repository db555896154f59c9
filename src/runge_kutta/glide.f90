!! Steps of a Runge-Kutta method far from any guard, by their maps (razy_runge_kutta_methods_step_maps), some in a row.
module razy_runge_kutta_glide
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: add_time
   use razy_motion_integrator, only: observer_slot_t, outcome_t, piece_t, show_piece
   use razy_runge_kutta_march, only: march_t
   use razy_runge_kutta_methods_step_strip, only: longest_strip
   implicit none(type, external)
   private

   public :: glide, largest

   !> A state beyond is a blow-up.
   real(wp), parameter :: largest = 1.0e100_wp

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   !> Go on for as long as there are maps of the steps proposed, no guard comes near, and the motion does not end; shows the steps
   !> of a strip together. `made`: the step that is next has been made by the stepper and awaits what the guards say.
   subroutine glide(march, piece, observers, outcome, made)
      class(march_t), intent(inout) :: march
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome
      logical, intent(out) :: made

      real(wp) :: start
      integer :: free
      logical :: possible

      made = .false.
      if (march%bounces%landing .or. .not. march%view%field%folded) return
      associate (field => march%view%field, stepper => march%view%stepper, strip => march%view%stepper%strip)
         do while (steps_to_try(march) > 0 .and. within(march%z))
            call march%start_field()
            start = march%tau
            call field%start_step(start)
            call stepper%begin_strip(field, start, march%z, possible)
            if (.not. possible) return
            call make_strip(march, steps_to_try(march), free)
            if (free > 0) then
               call march%doubts%of_strip(march%locator, field, strip, free, march%time + start)
               call stepper%go_on(field, start, free)
               call march%locator%move_on(free)
               outcome%steps = outcome%steps + free
               march%made = march%made + free
               call march%end_opening(strip%h, stepper%h_next)
               call show_strip(march, piece, observers, free)
            end if
            if (free < strip%count) then
               call stepper%load(field, start, free + 1)
               call march%memory%keep_count(march%made + 1)
               made = .true.
               return
            end if
            if (strip%refused) call stepper%refuse(field, possible)
            if (.not. possible) return
         end do
      end associate
   end subroutine glide

   !> Make up to `steps` steps of the strip: `free` of them are far from any guard. The first two are looked at before there are
   !> more.
   subroutine make_strip(march, steps, free)
      class(march_t), intent(inout) :: march
      integer, intent(in) :: steps
      integer, intent(out) :: free

      integer :: last

      associate (field => march%view%field, stepper => march%view%stepper, strip => march%view%stepper%strip)
         last = min(steps, 2)
         free = 0
         do
            call stepper%stride(field, last)
            call march%locator%clear(field, strip, free)
            if (free < last .or. last == steps) return
            last = steps
         end do
      end associate
   end subroutine make_strip

   !> How many steps to make at once: as many as the mode took the last time, or a few more, but not more than are left,
   !> and none that reaches the end of the motion.
   pure integer function steps_to_try(march) result(steps)
      class(march_t), intent(in) :: march

      real(wp) :: rest
      integer(i8) :: left

      rest = march%remaining()*(1.0_wp - 4*eps)/march%view%stepper%h_next
      if (march%made < march%expected) then
         steps = min(march%expected - march%made, longest_strip)
      else
         steps = min(2*(march%made - march%expected) + 2, longest_strip)
      end if
      if (rest < longest_strip + 1) steps = min(steps, ceiling(rest) - 1)
      left = march%method%most_steps - march%view%stepper%accepted_steps - march%view%stepper%rejected_steps
      steps = int(min(int(steps, i8), left))
   end function steps_to_try

   !> Show `steps` steps of the strip, from its start, and go to their end.
   subroutine show_strip(march, piece, observers, steps)
      class(march_t), intent(inout) :: march
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      integer, intent(in) :: steps

      integer :: i

      associate (view => march%view, strip => march%view%stepper%strip)
         call view%see_strip(march%tau, steps)
         piece%time = march%time
         piece%time_low = march%time_low
         call add_time(piece%time, piece%time_low, march%tau)
         piece%duration = view%duration
         piece%parts = steps
         piece%contact = 0
         piece%last = .false.
         call show_piece(observers, piece)
         piece%parts = 1
         call view%leave_strip()
         march%tau = march%tau + view%duration
         do i = 1, size(march%z)
            march%z(i) = strip%z(i, steps)
         end do
      end associate
   end subroutine show_strip

   !> Whether no component is so large that the motion has blown up.
   pure logical function within(z)
      real(wp), intent(in), contiguous :: z(:)

      integer :: i

      within = .true.
      do i = 1, size(z)
         within = within .and. abs(z(i)) <= largest
      end do
   end function within

end module razy_runge_kutta_glide
