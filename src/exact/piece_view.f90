!! A piece of the exact propagator's motion as observers see it: the closed form of one contact state from a start.
module razy_exact_piece_view
   use razy_core_kinds, only: wp
   use razy_exact_contact_state, only: contact_state_t, contact_states_t
   use razy_exact_contact_states, only: lay_out_contacts
   use razy_exact_closed_form_cursor, only: copy, cursor_t, reserve, set_state, state_of
   use razy_exact_closed_form_cursor_moves, only: move_to
   use razy_exact_closed_form_forms, only: curvature_bound, integral_of, size_of, value_and_slope, value_of
   use razy_motion_integrator, only: glimpse_t
   use razy_exact_search_refine, only: watched_t
   use razy_exact_search_search, only: exit_t, first_exit, rounding, search_t
   implicit none(type, external)
   private

   public :: exact_view_t, contact_of, direction_of, end_state, place, state_at, sums_of, turn_after, value_at

   !> The piece under way. `state` and `probe`, arguments of what follows, are its contact state and the cursor at its end.
   type :: exact_view_t
      !> Number of the contact state, duration, s.
      integer :: now = 0
      real(wp) :: duration = 0.0_wp
      !> Amplitudes at the start; cosine and sine of the phases there (tones).
      type(cursor_t) :: start
      real(wp), allocatable :: cosine(:), sine(:)
      !> What observers are answered with.
      type(cursor_t) :: looker
      logical :: looked = .false.
      !> State (2m) and excitation (tones) there, once a contact has been asked for.
      logical :: laid_out = .false.
      real(wp), allocatable :: z(:)
      complex(wp), allocatable :: turn(:)
      type(search_t) :: search
   contains
      procedure :: attach
   end type exact_view_t

contains

   !> Make room for m coordinates and the tones.
   subroutine attach(self, m, tones)
      class(exact_view_t), intent(inout) :: self
      integer, intent(in) :: m, tones

      if (allocated(self%z)) deallocate (self%z, self%turn, self%cosine, self%sine)
      allocate (self%z(2*m), self%turn(tones), self%cosine(tones), self%sine(tones))
   end subroutine attach

   !> A piece in contact state i starts at `time + time_low`, s, with z (2m).
   subroutine place(self, states, i, time, time_low, z)
      type(exact_view_t), intent(inout) :: self
      type(contact_states_t), intent(in) :: states
      integer, intent(in) :: i
      real(wp), intent(in) :: time, time_low, z(:)

      integer :: t

      self%now = i
      self%looked = .false.
      self%duration = 0.0_wp
      associate (state => states%state(i))
         do t = 1, size(self%cosine)
            call states%machine%tone(t)%phasor(time, time_low, self%cosine(t), self%sine(t))
         end do
         call reserve(self%start, state%response)
         if (state%held%n > 0) then
            call set_state(self%start, state%response, state%held%to_coordinates(z), self%cosine, self%sine)
         else
            call set_state(self%start, state%response, z, self%cosine, self%sine)
         end if
      end associate
   end subroutine place

   !> z (2m) at a cursor.
   subroutine end_state(state, cursor, z)
      type(contact_state_t), intent(in) :: state
      type(cursor_t), intent(in) :: cursor
      real(wp), intent(out) :: z(:)

      call state_of(cursor, state%response, z)
      if (state%held%n > 0) z = state%held%to_state(z)
   end subroutine end_state

   !> Amplitudes at `tau` into `self%looker`.
   subroutine look_at(self, response_of, probe, tau)
      type(exact_view_t), intent(inout) :: self
      type(contact_state_t), intent(in) :: response_of
      type(cursor_t), intent(in) :: probe
      real(wp), intent(in) :: tau

      if (self%looked .and. .not. abs(tau - self%looker%tau) > 0.0_wp) return
      self%looked = .true.
      self%laid_out = .false.
      associate (response => response_of%response)
         call reserve(self%looker, response)
         if (.not. abs(tau) > 0.0_wp) then
            call copy(self%start, response, self%looker)
         else if (.not. abs(tau - self%duration) > 0.0_wp) then
            call copy(probe, response, self%looker)
         else
            call move_to(self%start, response, tau, self%looker)
         end if
      end associate
   end subroutine look_at

   !> Value of observable `form` at `tau`.
   function value_at(self, state, probe, form, tau) result(value)
      type(exact_view_t), intent(inout) :: self
      type(contact_state_t), intent(in) :: state
      type(cursor_t), intent(in) :: probe
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      real(wp) :: value

      call look_at(self, state, probe, tau)
      value = value_of(state%observed, state%response, self%looker, form, 0)
   end function value_at

   !> Value, size and direction of observable `form` at `tau`, from up to four derivatives.
   subroutine direction_of(self, state, probe, form, tau, seen)
      type(exact_view_t), intent(inout) :: self
      type(contact_state_t), intent(in) :: state
      type(cursor_t), intent(in) :: probe
      integer, intent(in) :: form
      real(wp), intent(in) :: tau
      type(glimpse_t), intent(out) :: seen

      real(wp) :: rate
      real(wp) :: modulus(state%response%amplitudes)
      integer :: order

      call look_at(self, state, probe, tau)
      associate (rows => state%observed, response => state%response)
         modulus = sqrt(self%looker%re(:response%amplitudes)**2 + self%looker%im(:response%amplitudes)**2)
         seen%value = value_of(rows, response, self%looker, form, 0)
         seen%size = size_of(rows, response, self%looker, modulus, form, 0)
         do order = 1, 4
            rate = value_of(rows, response, self%looker, form, order)
            if (abs(rate) > rounding*size_of(rows, response, self%looker, modulus, form, order)) then
               seen%direction = nint(sign(1.0_wp, rate))
               return
            end if
         end do
      end associate
   end subroutine direction_of

   !> The next root of the observable's rate, found with the proof that none was before it.
   subroutine turn_after(self, state, form, tau, tau_end, direction, turned, found, tau_found, value)
      type(exact_view_t), intent(inout) :: self
      type(contact_state_t), intent(inout) :: state
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(in) :: turned
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found, value

      type(exit_t) :: turn
      type(watched_t) :: rate(1)

      rate(1) = watched_t(form=form, order=1, side=real(direction, wp), from_zero=turned)
      self%search%level = state%level
      call first_exit(self%search, state%response, state%observed, self%start, tau, tau_end, rate, turn)
      found = turn%watched /= 0
      tau_found = turn%tau
      value = 0.0_wp
      if (found) value = value_of(state%observed, state%response, self%search%probe, form, 0)
   end subroutine turn_after

   !> z (2m) at `tau`.
   subroutine state_at(self, state, probe, tau, z)
      type(exact_view_t), intent(inout) :: self
      type(contact_state_t), intent(in) :: state
      type(cursor_t), intent(in) :: probe
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: z(:)

      call look_at(self, state, probe, tau)
      call end_state(state, self%looker, z)
   end subroutine state_at

   !> Variable s, rate s' and reported force of contact j at `tau`.
   subroutine contact_of(self, states, probe, j, tau, s, rate, force)
      type(exact_view_t), intent(inout) :: self
      type(contact_states_t), intent(in) :: states
      type(cursor_t), intent(in) :: probe
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      integer :: t

      associate (state => states%state(self%now), touching => states%machine%contact(j), m => states%coupled%m)
         call look_at(self, state, probe, tau)
         if (.not. self%laid_out) then
            call end_state(state, self%looker, self%z)
            do t = 1, size(self%turn)
               self%turn(t) = cmplx(self%cosine(t), self%sine(t), wp)*cmplx(cos(states%omega(t)*tau), sin(states%omega(t)*tau), wp)
            end do
            self%laid_out = .true.
         end if
         s = dot_product(states%w(:, j), self%z(:m)) + touching%offset
         rate = dot_product(states%w(:, j), self%z(m + 1:)) + touching%drive
         do t = 1, size(self%cosine)
            s = s + real(self%turn(t)*touching%error(t))
            rate = rate - states%omega(t)*aimag(self%turn(t)*touching%error(t))
         end do
         if (states%jumps) then
            force = touching%force_sign*value_of(state%force, state%response, self%looker, j, 0)
         else
            force = touching%force_sign*touching%law%force(state%branch(j), s, rate, touching%normal)
         end if
      end associate
   end subroutine contact_of

   !> Integrals of what contact j does from `tau` to the end of the piece, where its force is k s + offset and no part is dense:
   !> the work is a difference of potentials then.
   subroutine sums_of(self, states, last, j, tau, largest, impulse, work, known)
      type(exact_view_t), intent(inout) :: self
      type(contact_states_t), intent(inout) :: states
      type(cursor_t), intent(in) :: last
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: largest, impulse, work
      logical, intent(out) :: known

      real(wp) :: distance, s(2), rate(2)

      associate (state => states%state(self%now), contact => states%machine%contact(j))
         associate (law => contact%law%branch(state%branch(j)), response => state%response)
            known = response%plain .and. .not. states%jumps .and. .not. abs(law%damping) > 0.0_wp
            if (.not. known .or. .not. max(abs(law%stiffness), abs(law%offset)) > 0.0_wp) return
            call lay_out_contacts(states, self%now)
            call look_at(self, state, last, tau)
            call value_and_slope(state%touching, response, self%looker, j, 0, s(1), rate(1))
            call value_and_slope(state%touching, response, last, j, 0, s(2), rate(2))
            impulse = impulse + contact%force_sign*(law%stiffness*integral_of(state%touching, response, self%looker, last, j) &
                                                    + law%offset*(last%tau - self%looker%tau))
            work = work + (s(2) - s(1))*(law%stiffness*0.5_wp*(s(1) + s(2)) + law%offset)
            largest = max(largest, maxval(abs(law%stiffness*s + law%offset)))
            if (.not. abs(law%stiffness) > 0.0_wp) return
            distance = largest/abs(law%stiffness)
            call raise_distance(self, state, j, -law%offset/law%stiffness, tau, s, rate, distance)
            largest = max(largest, abs(law%stiffness)*distance)
         end associate
      end associate
   end subroutine sums_of

   !> Raise `distance` to the largest |s - edge| of contact j at the turns of s between `tau` and the end of the piece; s and s'
   !> at both are known. The search is spared where the curvature does not suffice for a larger one.
   subroutine raise_distance(self, state, j, edge, tau, s, rate, distance)
      type(exact_view_t), intent(inout) :: self
      type(contact_state_t), intent(inout) :: state
      integer, intent(in) :: j
      real(wp), intent(in) :: edge, tau, s(2), rate(2)
      real(wp), intent(inout) :: distance

      type(exit_t) :: turn
      type(watched_t) :: watched(1)
      real(wp) :: direction, from

      if (.not. state%response%growing) then
         if (maxval(abs(s - edge)) + (self%duration - tau)**2/8*curvature_bound(state%touching, state%response, self%looker, j) &
             <= distance) return
      end if
      direction = sign(1.0_wp, rate(1))
      from = tau
      watched(1) = watched_t(form=j, order=1)
      do while (from < self%duration)
         watched(1)%side = direction
         watched(1)%from_zero = from > tau
         self%search%level = state%level
         call first_exit(self%search, state%response, state%touching, self%start, from, self%duration, watched, turn)
         if (turn%watched == 0) return
         distance = max(distance, abs(value_of(state%touching, state%response, self%search%probe, j, 0) - edge))
         from = turn%tau
         direction = -direction
      end do
   end subroutine raise_distance

end module razy_exact_piece_view
