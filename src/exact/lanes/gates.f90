!! Modes and gates that motions go through side by side: what all machines with the same matrices have in common, and what each
!! motion has of its own.
!!
!! A gate leads from one mode through one of its guards into the next. Its numbers, and those of modes, are made from the closed
!! forms that the propagator of one motion has found (razy_exact_solutions). All guards of a mode are on one form, as those of a
!! machine with one contact are: motions with several contacts spread over so many gates that lanes stay empty. Lists of amplitudes
!! hold the real parts of terms, their imaginary parts, rigid modes and their rates, and nothing else.
module razy_exact_lanes_gates
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_passage, only: passage_column
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_solutions, only: solution_t
   implicit none(type, external)
   private

   public :: fits_lanes, gate_t, is_of_mode, lane_mode_t, list_amplitudes, new_gate, new_lane_mode, numbers_of_gate, &
             numbers_of_mode, order, take_amplitudes

   !> Degree of Taylor polynomials.
   integer, parameter :: order = 16
   !> The angle by which the fastest exponent or tone turns on a stretch at most.
   real(wp), parameter :: longest_angle = 3.0_wp
   !> Amplitudes, beyond which a mode is not followed in lanes: nothing would be gained.
   integer, parameter :: most_rows = 12

   !> The way out of a mode through one of its guards.
   type :: gate_t
      !> Number among all gates, 0: it is not known yet; how many motions wait at it.
      integer :: number = 0, waiting = 0
      !> The mode that follows, and its guard that starts on the same bound, or 0.
      integer :: to = 0, zero = 0
      !> Amplitudes of the mode before; what they give to those of the next (amplitudes, before).
      integer :: before = 0
      real(wp), allocatable :: matrix(:, :)
   end type gate_t

   type :: lane_mode_t
      integer, allocatable :: branch(:)
      !> Terms, tones, rigid modes, amplitudes in all; guards.
      integer :: terms = 0, tones = 0, rigid = 0, rows = 0, guards = 0
      !> Length of a stretch, s.
      real(wp) :: step = 0.0_wp
      !> Exponents, and factors over a stretch (real parts, then imaginary ones).
      real(wp), allocatable :: decay(:), turn(:), grown(:)
      !> What terms give to Taylor coefficients of the form over a stretch (0:order, 2 terms); what their moduli give to bounds: of
      !> what these leave out, and of the third and fourth derivative (terms, 3); coefficients of rigid modes and their rates.
      real(wp), allocatable :: series(:, :), bounds_by(:, :), rigid_y(:), rigid_v(:)
      !> Side of each guard.
      real(wp), allocatable :: side(:)
      !> Places of each motion's own numbers: the form's constant, size and reach; before those of the guards' bounds, of forces on
      !> rigid modes, of factors of tones over a stretch and of their coefficients in the form (two each); how many they are.
      integer :: constant = 1, size = 2, reach = 3, bounds = 3, forces = 0, turns = 0, waves = 0, numbers = 0
      !> Through each guard.
      type(gate_t), allocatable :: gate(:)
   end type lane_mode_t

contains

   !> Whether the motion of a solution may be followed in lanes: nothing grows, is driven by a near frequency, dense or held.
   pure logical function fits_lanes(solution)
      type(solution_t), intent(in) :: solution

      associate (response => solution%response)
         fits_lanes = response%bounded .and. solution%constrained%n == 0 .and. size(solution%watched) > 0 &
                      .and. response%rows <= most_rows .and. solution%switching%forms == 1 .and. response%fastest > 0.0_wp
      end associate
   end function fits_lanes

   !> Whether a solution, of a machine with the same matrices, is one in this mode.
   pure logical function is_of_mode(solution, mode)
      type(solution_t), intent(in) :: solution
      type(lane_mode_t), intent(in) :: mode

      is_of_mode = all(solution%branch == mode%branch) .and. solution%response%terms == mode%terms &
                   .and. size(solution%watched) == mode%guards
      if (is_of_mode) is_of_mode = .not. (abs(step_of(solution%response) - mode%step) > 0.0_wp &
                                          .or. any(abs(solution%response%decay(:mode%terms) - mode%decay) > 0.0_wp) &
                                          .or. any(abs(solution%response%turn(:mode%terms) - mode%turn) > 0.0_wp))
   end function is_of_mode

   !> Length of a stretch, s: nothing turns by more than the longest angle, and tones below the same power of two do not change it.
   pure real(wp) function step_of(response)
      type(response_t), intent(in) :: response

      associate (n => response%terms)
         step_of = longest_angle/max(maxval([0.0_wp, response%modulus(:n)]), &
                                     scale(1.0_wp, exponent(maxval([tiny(1.0_wp), response%turn(n + 1:n + response%tones)]))))
      end associate
   end function step_of

   !> What the solution of one motion has in common with others of the same matrices.
   pure subroutine new_lane_mode(self, solution)
      type(lane_mode_t), intent(out) :: self
      type(solution_t), intent(in) :: solution

      complex(wp) :: coefficient
      integer :: k, p

      associate (response => solution%response, rows => solution%switching, n => solution%response%terms)
         self%branch = solution%branch
         self%terms = n
         self%tones = response%tones
         self%rigid = response%rigid
         self%rows = response%rows
         self%guards = size(solution%watched)
         self%side = solution%watched%side
         self%step = step_of(response)
         self%decay = response%decay(:n)
         self%turn = response%turn(:n)
         self%grown = exp(self%decay*self%step)
         self%grown = [self%grown*cos(self%turn*self%step), self%grown*sin(self%turn*self%step)]
         self%rigid_y = rows%rigid_y(:, 1)
         self%rigid_v = rows%rigid_v(:, 1)
         allocate (self%series(0:order, 2*n), self%bounds_by(n, 3))
         do k = 1, n
            coefficient = cmplx(rows%on(k, 0, 1), -rows%on(response%filled + k, 0, 1), wp)
            do p = 0, order
               self%series(p, k) = real(coefficient)
               self%series(p, n + k) = -aimag(coefficient)
               coefficient = coefficient*response%exponent(k)*(self%step/(p + 1))
            end do
            self%bounds_by(k, :) = [abs(coefficient), rows%moduli(k, 0, 1)*(response%modulus(k)*self%step)**[3, 4]]
         end do
      end associate
      allocate (self%gate(self%guards))
      call lay_out(self)
   end subroutine new_lane_mode

   !> Places of what each motion has of its own.
   pure subroutine lay_out(self)
      type(lane_mode_t), intent(inout) :: self

      self%forces = self%bounds + self%guards
      self%turns = self%forces + self%rigid
      self%waves = self%turns + 2*self%tones
      self%numbers = self%waves + 2*self%tones
   end subroutine lay_out

   !> A motion's own numbers in a mode.
   pure function numbers_of_mode(self, solution) result(own)
      type(lane_mode_t), intent(in) :: self
      type(solution_t), intent(in) :: solution
      real(wp) :: own(self%numbers)

      real(wp) :: angle
      integer :: t

      associate (response => solution%response, rows => solution%switching)
         own(self%constant) = rows%constant(1)
         own(self%size) = rows%reach_constant(1) + 2*abs(rows%constant(1)) + 2*self%tones*rows%longest_reach(1) &
                          + maxval(abs(solution%watched%bound))
         own(self%reach) = 2*rows%longest_reach(1)
         own(self%bounds + 1:self%bounds + self%guards) = solution%watched%bound
         own(self%forces + 1:self%forces + self%rigid) = response%rigid_force
         do t = 1, self%tones
            angle = response%turn(self%terms + t)*self%step
            own(self%turns + 2*t - 1:self%turns + 2*t) = [cos(angle), sin(angle)]
            own(self%waves + 2*t - 1) = rows%on(self%terms + t, 0, 1)
            own(self%waves + 2*t) = rows%on(response%filled + self%terms + t, 0, 1)
         end do
      end associate
   end function numbers_of_mode

   !> Gate `number`, through `guard` of the mode of one motion's solution `before`, into mode number `to` with the solution `after`.
   pure subroutine new_gate(self, number, before, guard, to, after)
      type(gate_t), intent(out) :: self
      integer, intent(in) :: number, guard, to
      type(solution_t), intent(in) :: before, after

      integer :: i

      self%number = number
      self%to = to
      self%before = before%response%rows
      associate (entry => before%entry(guard), watched => before%watched(guard))
         do i = 1, size(after%watched)
            if (after%entry(i)%contact /= entry%contact .or. after%entry(i)%function /= entry%function) cycle
            ! It has come from the other side of this bound.
            if (.not. after%watched(i)%side*watched%side < 0.0_wp) cycle
            if (.not. abs(after%watched(i)%bound - watched%bound) > 0.0_wp) self%zero = i
         end do
      end associate
      allocate (self%matrix(after%response%rows, self%before))
      do i = 1, self%before
         call passage_column(before%response, after%response, place_of(before%response, i), self%matrix(:, i))
      end do
   end subroutine new_gate

   !> A motion's own numbers in a passage from `before` to `after`: what each tone, cosine and sine, and the constant 1 give to the
   !> amplitudes.
   pure function numbers_of_gate(before, after) result(own)
      type(response_t), intent(in) :: before, after
      real(wp) :: own(after%rows*(2*after%tones + 1))

      integer :: t

      do t = 1, after%tones
         call passage_column(before, after, before%terms + t, own((2*t - 2)*after%rows + 1:(2*t - 1)*after%rows))
         call passage_column(before, after, before%filled + before%terms + t, own((2*t - 1)*after%rows + 1:2*t*after%rows))
      end do
      call passage_column(before, after, before%one, own(2*after%tones*after%rows + 1:))
   end function numbers_of_gate

   !> Place of amplitude i in the list of a motion (razy_exact_closed_form_amplitudes).
   elemental integer function place_of(response, i) result(place)
      type(response_t), intent(in) :: response
      integer, intent(in) :: i

      if (i <= response%terms) then
         place = i
      else if (i <= 2*response%terms) then
         place = response%filled + i - response%terms
      else
         place = response%one + i - 2*response%terms
      end if
   end function place_of

   !> The amplitudes in the list `x` of a motion.
   pure function take_amplitudes(response, x) result(amplitudes)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: x(:)
      real(wp) :: amplitudes(response%rows)

      integer :: i

      amplitudes = [(x(place_of(response, i)), i=1, response%rows)]
   end function take_amplitudes

   !> Enter amplitudes and the tones' cosines and sines into the list `x` of a motion.
   pure subroutine list_amplitudes(response, amplitudes, cosine, sine, x)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: amplitudes(:), cosine(:), sine(:)
      real(wp), intent(inout) :: x(:)

      associate (n => response%terms, f => response%filled, one => response%one, r => response%rigid, t => response%tones)
         x(:response%length) = 0.0_wp
         x(:n) = amplitudes(:n)
         x(f + 1:f + n) = amplitudes(n + 1:2*n)
         x(n + 1:n + t) = cosine
         x(f + n + 1:f + n + t) = sine
         x(one) = 1.0_wp
         x(one + 1:one + 2*r) = amplitudes(2*n + 1:2*(n + r))
         x(one + 2*r + 1:one + 3*r) = response%rigid_force
      end associate
   end subroutine list_amplitudes

end module razy_exact_lanes_gates
