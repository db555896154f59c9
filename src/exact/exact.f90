!! The exact propagator: motion of a piecewise-linear machine from event to event in closed form.
!!
!! Between two changes of the contact state nothing is integrated; the next change is found with proof that none was before
!! it (razy_exact_search_search). The state carries over an event unchanged, but for the jumps of velocity at impacts of rigid
!! contacts (razy_exact_jumps); the phases of excitation are formed anew from the time, which is kept in two doubles, so
!! that errors do not grow with the number of pieces.
module razy_exact_exact
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: i8, wp
   use razy_exact_exact_jumps, only: run_with_jumps
   use razy_exact_exact_smooth, only: run_without_jumps
   use razy_exact_piece_view, only: contact_of, direction_of, state_at, sums_of, turn_after, value_at
   use razy_motion_integrator, only: glimpse_t, integrator_t, observer_slot_t, outcome_t
   use razy_exact_jumps, only: jumps_t
   use razy_exact_propagation, only: propagation_t
   use razy_machine_machine, only: machine_t
   implicit none(type, external)
   private

   public :: exact_t

   !> The propagator with what it keeps from run to run. A run ends with a status after `most_steps` steps of its search.
   type, extends(integrator_t) :: exact_t
      integer(i8) :: most_steps = huge(1_i8)
      type(propagation_t) :: motion
      type(jumps_t) :: jumps
   contains
      procedure :: prepare
      procedure :: run
      procedure :: value
      procedure :: glimpse
      procedure :: next_turn
      procedure :: state
      procedure :: contact
      procedure :: branch_now
      procedure :: interval
      procedure :: final_state
      procedure :: contact_sums
   end type exact_t

contains

   !> Take a machine; refused with an error if one of its laws is not piecewise linear.
   subroutine prepare(self, machine, keep_all, error)
      class(exact_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: j

      do j = 1, size(machine%contact)
         if (machine%contact(j)%law%piecewise_linear) cycle
         call raise(error, "the exact propagator cannot follow contact '"//machine%contact(j)%name// &
                    "', whose law is not piecewise linear")
         return
      end do
      call self%motion%attach(machine, keep_all, error)
      if (allocated(error)) return
      if (self%motion%states%jumps) call self%jumps%attach(machine, keep_all, error)
   end subroutine prepare

   !> Run the prepared machine from 0 to `t_end`, s, showing every piece to the observers.
   subroutine run(self, t_end, most_events, observers, outcome)
      class(exact_t), intent(inout), target :: self
      real(wp), intent(in) :: t_end
      integer(i8), intent(in) :: most_events
      type(observer_slot_t), intent(in) :: observers(:)
      type(outcome_t), intent(out) :: outcome

      integer(i8) :: steps, halvings
      class(integrator_t), pointer :: by

      by => self
      steps = self%motion%search%steps
      halvings = self%motion%search%halvings
      self%motion%search%most_steps = huge(1_i8)
      if (self%most_steps < huge(1_i8) - steps) self%motion%search%most_steps = steps + self%most_steps
      if (self%motion%states%jumps) then
         call run_with_jumps(self%motion, self%jumps, by, t_end, most_events, observers, outcome)
      else
         call run_without_jumps(self%motion, by, t_end, most_events, observers, outcome)
      end if
      outcome%steps = self%motion%search%steps - steps
      outcome%halvings = self%motion%search%halvings - halvings
      outcome%states = self%motion%states%count
   end subroutine run

   !> Value of observable `form` at `tau`.
   function value(self, form, tau)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      value = value_at(self%motion%view, self%motion%states%state(self%motion%view%now), self%motion%search%probe, form, tau)
   end function value

   !> Value, size and direction of observable `form` at `tau`, from up to four derivatives.
   subroutine glimpse(self, form, tau, seen)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      call direction_of(self%motion%view, self%motion%states%state(self%motion%view%now), self%motion%search%probe, form, tau, seen)
   end subroutine glimpse

   !> The next root of the observable's rate, found with the proof that none was before it.
   subroutine next_turn(self, form, tau, tau_end, direction, turned, found, tau_found, value)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      associate (motion => self%motion)
         call turn_after(motion%view, motion%states%state(motion%view%now), form, tau, tau_end, direction, turned, found, &
                         tau_found, value)
      end associate
   end subroutine next_turn

   !> Displacements and velocities (n each) at `tau`; needs a machine prepared with `keep_all`.
   subroutine state(self, tau, displacement, velocity)
      class(exact_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: displacement(:), velocity(:)

      real(wp) :: z(size(self%motion%z))

      call state_at(self%motion%view, self%motion%states%state(self%motion%view%now), self%motion%search%probe, tau, z)
      call to_coordinates(self, z, displacement, velocity)
   end subroutine state

   !> Displacements and velocities (n each) that the last run ended with; needs a machine prepared with `keep_all`.
   subroutine final_state(self, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(out) :: displacement(:), velocity(:)

      call to_coordinates(self, self%motion%z, displacement, velocity)
   end subroutine final_state

   pure subroutine to_coordinates(self, z, displacement, velocity)
      class(exact_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: displacement(:), velocity(:)

      associate (coupled => self%motion%states%coupled)
         displacement = matmul(z(:coupled%m), coupled%project)
         velocity = matmul(z(coupled%m + 1:), coupled%project)
      end associate
   end subroutine to_coordinates

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact(self, j, tau, s, rate, force)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      call contact_of(self%motion%view, self%motion%states, self%motion%search%probe, j, tau, s, rate, force)
   end subroutine contact

   !> Integrals of what contact j does from `tau` to the end of the piece, where they are known in closed form.
   subroutine contact_sums(self, j, tau, largest, impulse, work, known)
      class(exact_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      call sums_of(self%motion%view, self%motion%states, self%motion%search%probe, j, tau, largest, impulse, work, known)
   end subroutine contact_sums

   !> Branch of contact j.
   pure function branch_now(self, j) result(branch)
      class(exact_t), intent(in) :: self
      integer, intent(in) :: j
      integer :: branch

      branch = self%motion%branch(j)
   end function branch_now

   !> The step of the search, or less, so that a turn of the fastest term has at least 25 points.
   pure function interval(self)
      class(exact_t), intent(in) :: self
      real(wp) :: interval

      associate (state => self%motion%states%state(self%motion%view%now))
         interval = scale(1.0_wp, -max(state%level, exponent(state%response%fastest) + 2))
      end associate
   end function interval

end module razy_exact_exact
