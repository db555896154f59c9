!! What observers see of a step of the Moreau–Jean scheme.
!!
!! Within a step of length h displacements are the parabola q(τ) = q + v τ + θ (Δv/h) τ², velocities the line v + (Δv/h) τ; with
!! θ = 1/2 the second is the rate of the first. So the jump of an impact is spread over its step. Excitation is exact. Contact
!! forces, known as means over steps (rigid contacts, friction) or at their ends (compliant laws), are joined by lines.
module razy_moreau_view
   use razy_core_kinds, only: wp
   use razy_core_tone, only: add_time
   use razy_machine_machine, only: machine_t, observe_contact_force
   use razy_moreau_state, only: moreau_step_t
   implicit none(type, external)
   private

   public :: contact_of, displacement_of, find_turn, moreau_view_t, observe, velocity_of, view_end, view_step

   !> Rates below this part of their terms are rounding.
   real(wp), parameter :: rounding = 64*epsilon(1.0_wp)

   !> A piece as it is shown: time of its start (sum of both) and length, s; state (n) there, half the second and the first
   !> derivative of displacement and velocity; contact forces (contacts) and their rates.
   type :: moreau_view_t
      real(wp) :: time = 0.0_wp, time_low = 0.0_wp, duration = 0.0_wp
      real(wp), allocatable :: q(:), v(:), bend(:), force(:)
      real(wp), allocatable, private :: acceleration(:), force_rate(:)
   end type moreau_view_t

contains

   !> See the last step, which started at `time + time_low`.
   pure subroutine view_step(view, step, time, time_low)
      type(moreau_view_t), intent(inout) :: view
      type(moreau_step_t), intent(in) :: step
      real(wp), intent(in) :: time, time_low

      view%time = time
      view%time_low = time_low
      view%duration = step%h
      view%q = step%q0
      view%v = step%v0
      view%acceleration = (step%v1 - step%v0)/step%h
      view%bend = step%theta*view%acceleration
      view%force = step%force0
      view%force_rate = (step%force1 - step%force0)/step%h
   end subroutine view_step

   !> See the end of the last step, at `time + time_low`, as a piece without length.
   pure subroutine view_end(view, step, time, time_low)
      type(moreau_view_t), intent(inout) :: view
      type(moreau_step_t), intent(in) :: step
      real(wp), intent(in) :: time, time_low

      view%time = time
      view%time_low = time_low
      view%duration = 0.0_wp
      view%q = step%q1
      view%v = step%v1
      view%force = step%force1
      view%acceleration = 0.0_wp*step%v1
      view%bend = view%acceleration
      view%force_rate = 0.0_wp*step%force1
   end subroutine view_end

   !> Displacements (n) at `tau` s after the start of the piece.
   pure function displacement_of(view, tau) result(q)
      type(moreau_view_t), intent(in) :: view
      real(wp), intent(in) :: tau
      real(wp) :: q(size(view%q))

      q = view%q + tau*(view%v + tau*view%bend)
   end function displacement_of

   !> Velocities (n) at `tau`.
   pure function velocity_of(view, tau) result(v)
      type(moreau_view_t), intent(in) :: view
      real(wp), intent(in) :: tau
      real(wp) :: v(size(view%v))

      v = view%v + tau*view%acceleration
   end function velocity_of

   !> Derivative of `order` 0, 1 or 2 of observable `form` at `tau`, and the size of the terms that it is the sum of.
   pure subroutine observe(view, machine, form, tau, order, value, terms)
      type(moreau_view_t), intent(in) :: view
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: form, order
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: value, terms

      real(wp) :: q(size(view%q)), v(size(view%v))

      associate (observable => machine%observable(form))
         if (observable%kind == observe_contact_force) then
            call observe_force(view, machine%contact(observable%contact)%force_sign, observable%contact, tau, order, value, terms)
            return
         end if
         select case (order)
         case (0)
            q = displacement_of(view, tau)
            v = velocity_of(view, tau)
         case (1)
            q = view%v + 2*tau*view%bend
            v = view%acceleration
         case default
            q = 2*view%bend
            v = 0.0_wp
         end select
         value = dot_product(observable%on_displacement, q) + dot_product(observable%on_velocity, v)
         terms = dot_product(abs(observable%on_displacement), abs(q)) + dot_product(abs(observable%on_velocity), abs(v))
         if (order == 0) then
            value = value + observable%constant
            terms = terms + abs(observable%constant)
         end if
         call add_tones(machine, observable%error, view%time, view%time_low, tau, order, value, terms)
      end associate
   end subroutine observe

   !> Add the derivative of Re(Σ error e^{iωt}).
   pure subroutine add_tones(machine, error, time, time_low, tau, order, value, terms)
      type(machine_t), intent(in) :: machine
      complex(wp), intent(in) :: error(:)
      real(wp), intent(in) :: time, time_low, tau
      integer, intent(in) :: order
      real(wp), intent(inout) :: value, terms

      real(wp) :: at, at_low, cosine, sine
      complex(wp) :: turn
      integer :: t

      at = time
      at_low = time_low
      call add_time(at, at_low, tau)
      do t = 1, size(machine%tone)
         if (.not. abs(error(t)) > 0.0_wp) cycle
         call machine%tone(t)%phasor(at, at_low, cosine, sine)
         turn = error(t)*cmplx(cosine, sine, wp)*cmplx(0.0_wp, machine%tone(t)%omega, wp)**order
         value = value + real(turn)
         terms = terms + abs(turn)
      end do
   end subroutine add_tones

   pure subroutine observe_force(view, force_sign, j, tau, order, value, terms)
      type(moreau_view_t), intent(in) :: view
      real(wp), intent(in) :: force_sign, tau
      integer, intent(in) :: j, order
      real(wp), intent(out) :: value, terms

      select case (order)
      case (0)
         value = force_sign*(view%force(j) + tau*view%force_rate(j))
         terms = abs(view%force(j)) + tau*abs(view%force_rate(j))
      case (1)
         value = force_sign*view%force_rate(j)
         terms = abs(value)
         if (view%duration > 0.0_wp) terms = terms + abs(view%force(j))/view%duration
      case default
         value = 0.0_wp
         terms = 0.0_wp
      end select
   end subroutine observe_force

   !> s, s' and reported force of contact j at `tau`.
   pure subroutine contact_of(view, machine, j, tau, s, rate, force)
      type(moreau_view_t), intent(in) :: view
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: j
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: s, rate, force

      real(wp) :: terms

      associate (contact => machine%contact(j))
         terms = 0.0_wp
         s = dot_product(contact%w, displacement_of(view, tau)) + contact%offset
         rate = dot_product(contact%w, velocity_of(view, tau)) + contact%drive
         call add_tones(machine, contact%error, view%time, view%time_low, tau, 0, s, terms)
         call add_tones(machine, contact%error, view%time, view%time_low, tau, 1, rate, terms)
         force = contact%force_sign*(view%force(j) + tau*view%force_rate(j))
      end associate
   end subroutine contact_of

   !> The first time after `tau` at which observable `form` no longer moves in `direction`, if it moves the other way at
   !> `tau_end`: bisection of its rate. Two turns within a step are not seen.
   pure subroutine find_turn(view, machine, form, tau, tau_end, direction, found, tau_found)
      type(moreau_view_t), intent(in) :: view
      type(machine_t), intent(in) :: machine
      integer, intent(in) :: form, direction
      real(wp), intent(in) :: tau, tau_end
      logical, intent(out) :: found
      real(wp), intent(out) :: tau_found

      real(wp) :: before, middle, rate, terms
      integer :: i

      before = tau
      tau_found = tau_end
      call observe(view, machine, form, tau_end, 1, rate, terms)
      found = direction*rate < -rounding*terms
      if (.not. found) return
      do i = 1, digits(1.0_wp)
         middle = 0.5_wp*(before + tau_found)
         if (.not. (middle > before .and. middle < tau_found)) exit
         call observe(view, machine, form, middle, 1, rate, terms)
         if (direction*rate > 0.0_wp) then
            before = middle
         else
            tau_found = middle
         end if
      end do
   end subroutine find_turn

end module razy_moreau_view
