!! Steps of a Runge-Kutta method far from any guard, by their maps (razy_integrate_step_maps), one after the other.
module razy_integrate_runge_kutta_glide
   use razy_core_kinds, only: wp
   use razy_core_tone, only: add_time
   use razy_integrate_integrator, only: observer_slot_t, outcome_t, piece_t, show_piece
   use razy_integrate_runge_kutta_march, only: march_t
   implicit none(type, external)
   private

   public :: glide, largest

   !> A state beyond is a blow-up.
   real(wp), parameter :: largest = 1.0e100_wp

   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   !> Go on for as long as there are maps of the steps proposed, no guard comes near, and the motion does not end; shows every step.
   !> `made`: the step that is next has been made by the stepper and awaits what the guards say.
   subroutine glide(march, piece, observers, outcome, made)
      class(march_t), intent(inout) :: march
      type(piece_t), intent(inout) :: piece
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(inout) :: outcome
      logical, intent(out) :: made

      integer :: i
      logical :: free

      made = .false.
      if (march%bounces%landing .or. .not. march%view%field%folded) return
      associate (view => march%view, field => march%view%field, stepper => march%view%stepper)
         do
            if (.not. stepper%h_next < march%remaining()*(1.0_wp - 4*eps)) return
            if (stepper%accepted_steps + stepper%rejected_steps >= march%method%most_steps) return
            if (.not. within(march%z)) return
            call march%start_field()
            call field%start_step(march%tau)
            call stepper%glide(field, march%tau, march%z, made)
            if (.not. made) return
            call march%locator%clear(field, stepper%h, stepper%z_end, stepper%dz_end, free)
            if (.not. free) return
            made = .false.
            call stepper%go_on(field)
            call march%doubts%known%step(march%method, stepper, march%z, march%opening)
            call march%end_opening()
            outcome%steps = outcome%steps + 1
            view%start = march%tau
            view%h = stepper%h
            view%duration = stepper%h
            view%dense = .false.
            view%moment = .false.
            do i = 1, size(march%z)
               view%z_start(i) = march%z(i)
               view%z_stop(i) = stepper%z_end(i)
            end do
            piece%time = march%time
            piece%time_low = march%time_low
            call add_time(piece%time, piece%time_low, march%tau)
            piece%duration = stepper%h
            piece%contact = 0
            piece%last = .false.
            call show_piece(observers, piece)
            march%tau = march%tau + stepper%h
            do i = 1, size(march%z)
               march%z(i) = stepper%z_end(i)
            end do
         end do
      end associate
   end subroutine glide

   !> Whether no component is so large that the motion has blown up.
   pure logical function within(z)
      real(wp), intent(in), contiguous :: z(:)

      integer :: i

      within = .true.
      do i = 1, size(z)
         within = within .and. abs(z(i)) <= largest
      end do
   end function within

end module razy_integrate_runge_kutta_glide
