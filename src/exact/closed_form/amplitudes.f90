!! A point on the closed form: amplitudes at a time of a piece, moved by steps of 2^-level s or to any time.
!!
!! Steps multiply amplitudes by tabulated factors and serve the search for events; what is kept of an event is evaluated from the
!! start of the piece, so that the state between events does not depend on the steps. Nothing is allocated here but by `reserve`,
!! when a response is larger than all before it, and by entries of the table of steps.
module razy_exact_closed_form_amplitudes
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_response, only: response_t
   use razy_linalg_exponential, only: exponential_action, matrix_exponential
   use razy_linalg_wide_sums, only: add_product, rotate, wide
   implicit none(type, external)
   private

   public :: amplitudes_t, copy, go_from, move_to, reserve, set_state, shift, state_of, step, tabulate, carry_disturbance

   !> Arrays may be longer than the response at hand needs.
   type :: amplitudes_t
      !> Time since the start of the segment, s.
      real(wp) :: tau = 0.0_wp
      !> Amplitudes of terms and tones, rigid modes and their rates, dense states.
      real(wp), allocatable :: re(:), im(:), rigid(:), rate(:), dense(:)
      !> Workspace: cosine and sine of each tone.
      real(wp), allocatable :: tone(:)
   end type amplitudes_t

   !> Times the fastest exponent, a shift for which short series do.
   real(wp), parameter :: tiny_angle = 3.0e-3_wp

contains

   !> Make room for a response, beside all those before.
   pure subroutine reserve(self, response)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response

      integer :: room(3)

      room = [response%amplitudes, response%rigid, response%nx] + 8
      if (allocated(self%re)) then
         associate (now => [size(self%re), size(self%rigid), size(self%dense)])
            if (all(now >= room - 8)) return
            room = max(room, now)
         end associate
         deallocate (self%re, self%im, self%rigid, self%rate, self%dense, self%tone)
      end if
      allocate (self%re(room(1)), self%im(room(1)), self%tone(2*room(1)))
      allocate (self%rigid(room(2)), self%rate(room(2)), self%dense(room(3)))
   end subroutine reserve

   !> Put the cursor at tau = 0 with the state z (2m) and the tones' phasors (tones).
   pure subroutine set_state(self, response, z, phasor)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: z(:)
      complex(wp), intent(in) :: phasor(:)

      real(wp) :: rest(2*response%m)
      integer :: i, j, m, n

      m = response%m
      n = response%terms
      self%tau = 0.0_wp
      do i = 1, 2*m
         rest(i) = z(i) - response%constant(i)
      end do
      do j = 1, response%tones
         do i = 1, 2*m
            rest(i) = rest(i) - (response%from_re(i, n + j)*phasor(j)%re + response%from_im(i, n + j)*phasor(j)%im)
         end do
         self%re(n + j) = phasor(j)%re
         self%im(n + j) = phasor(j)%im
      end do
      if (n >= wide) then
         self%re(:n) = 0.0_wp
         self%im(:n) = 0.0_wp
         call add_product(n, 2*m, response%into_re, rest, self%re)
         call add_product(n, 2*m, response%into_im, rest, self%im)
      else
         do j = 1, n
            self%re(j) = 0.0_wp
            self%im(j) = 0.0_wp
            do i = 1, 2*m
               self%re(j) = self%re(j) + response%to_re(i, j)*rest(i)
               self%im(j) = self%im(j) + response%to_im(i, j)*rest(i)
            end do
         end do
      end if
      if (response%driven%loaded) then
         self%re(response%amplitudes) = 1.0_wp
         self%im(response%amplitudes) = 0.0_wp
      end if
      do j = 1, response%rigid
         self%rigid(j) = 0.0_wp
         self%rate(j) = 0.0_wp
         do i = 1, m
            self%rigid(j) = self%rigid(j) + response%rigid_mode(i, j)*rest(i)
            self%rate(j) = self%rate(j) + response%rigid_mode(i, j)*rest(m + i)
         end do
      end do
      do j = 1, size(response%dense)
         call response%dense(j)%start(z, phasor, self%dense(response%first(j):response%first(j + 1) - 1))
      end do
   end subroutine set_state

   !> The state z (2m) at the cursor.
   pure subroutine state_of(self, response, z)
      type(amplitudes_t), intent(in) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(out) :: z(:)

      integer :: i, j, m

      m = response%m
      do i = 1, 2*m
         z(i) = response%constant(i)
      end do
      if (response%terms >= wide) then
         call add_product(2*m, response%amplitudes, response%from_re, self%re, z)
         call add_product(2*m, response%amplitudes, response%from_im, self%im, z)
      else
         do j = 1, response%amplitudes
            do i = 1, 2*m
               z(i) = z(i) + (response%from_re(i, j)*self%re(j) + response%from_im(i, j)*self%im(j))
            end do
         end do
      end if
      do j = 1, response%rigid
         do i = 1, m
            z(i) = z(i) + response%rigid_mode(i, j)*self%rigid(j)
            z(m + i) = z(m + i) + response%rigid_mode(i, j)*self%rate(j)
         end do
      end do
      do j = 1, size(response%dense)
         call response%dense(j)%add_state(self%dense(response%first(j):response%first(j + 1) - 1), z)
      end do
   end subroutine state_of

   !> Copy what the response uses of a cursor.
   pure subroutine copy(from, response, to)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(inout) :: to

      integer :: i

      to%tau = from%tau
      do i = 1, response%amplitudes
         to%re(i) = from%re(i)
         to%im(i) = from%im(i)
      end do
      do i = 1, response%rigid
         to%rigid(i) = from%rigid(i)
         to%rate(i) = from%rate(i)
      end do
      do i = 1, response%nx
         to%dense(i) = from%dense(i)
      end do
   end subroutine copy

   !> Move from `from` by 2^-level s; makes the table's entry when it is used for the first time.
   pure subroutine step(from, response, level, self)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      type(amplitudes_t), intent(inout) :: self

      real(wp) :: h, re
      integer :: i

      if (.not. response%has_step(level)) call tabulate(response, level)
      h = response%step_length(level)
      self%tau = from%tau + h
      if (response%terms >= wide) then
         call rotate(response%amplitudes, from%re, from%im, response%step_re(:, level), response%step_im(:, level), &
                     self%re, self%im)
      else
         do i = 1, response%amplitudes
            re = from%re(i)*response%step_re(i, level) - from%im(i)*response%step_im(i, level)
            self%im(i) = from%re(i)*response%step_im(i, level) + from%im(i)*response%step_re(i, level)
            self%re(i) = re
         end do
      end if
      do i = 1, response%rigid
         self%rigid(i) = from%rigid(i) + h*(from%rate(i) + 0.5_wp*h*response%rigid_force(i))
         self%rate(i) = from%rate(i) + h*response%rigid_force(i)
      end do
      if (response%driven%count > 0) then
         call take_tones(self, response, from%re, from%im)
         call push_by_table(self, response, level)
      end if
      if (response%nx == 0) return
      self%dense(:response%nx) = from%dense(:response%nx)
      call step_dense(response, level, self%dense)
   end subroutine step

   !> Evaluate the closed form that starts at `start` at the time `tau` of the segment.
   pure subroutine move_to(start, response, tau, self)
      type(amplitudes_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      type(amplitudes_t), intent(inout) :: self

      real(wp) :: re, im
      integer :: i, j, k

      self%tau = tau
      do i = 1, response%amplitudes
         call growth(response%exponent(i), tau, re, im)
         self%re(i) = start%re(i)*re - start%im(i)*im
         self%im(i) = start%re(i)*im + start%im(i)*re
      end do
      if (response%driven%count > 0) call add_excitation(start, response, tau, self)
      do i = 1, response%rigid
         self%rigid(i) = start%rigid(i) + tau*(start%rate(i) + 0.5_wp*tau*response%rigid_force(i))
         self%rate(i) = start%rate(i) + tau*response%rigid_force(i)
      end do
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         call exponential_action(response%dense(i)%matrix, response%dense(i)%norm, tau, start%dense(j:k), self%dense(j:k))
      end do
   end subroutine move_to

   !> Go from `from` by `tau` (s), shorter than 2^-level: binary digits of tau down to the response's fine level by the table
   !> of steps; what is left of tau by `shift`, or not at all if `coarsely`, and then tau is shortened by it.
   pure subroutine go_from(from, response, level, coarsely, tau, self)
      type(amplitudes_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      logical, intent(in) :: coarsely
      real(wp), intent(inout) :: tau
      type(amplitudes_t), intent(inout) :: self

      real(wp) :: h, re, rest
      integer :: i, k

      call copy(from, response, self)
      rest = tau
      h = response%step_length(level)
      do k = level + 1, response%fine_level
         h = 0.5_wp*h
         if (rest < h) cycle
         rest = rest - h
         if (.not. response%has_step(k)) call tabulate(response, k)
         if (response%driven%count > 0) call take_tones(self, response, self%re, self%im)
         do i = 1, response%amplitudes
            re = self%re(i)*response%step_re(i, k) - self%im(i)*response%step_im(i, k)
            self%im(i) = self%re(i)*response%step_im(i, k) + self%im(i)*response%step_re(i, k)
            self%re(i) = re
         end do
         if (response%driven%count > 0) call push_by_table(self, response, k)
         if (response%nx > 0) call step_dense(response, k, self%dense)
      end do
      h = tau - rest
      do i = 1, response%rigid
         self%rigid(i) = from%rigid(i) + h*(from%rate(i) + 0.5_wp*h*response%rigid_force(i))
         self%rate(i) = from%rate(i) + h*response%rigid_force(i)
      end do
      if (coarsely) then
         tau = h
      else
         call shift(self, response, rest)
      end if
      self%tau = from%tau + tau
   end subroutine go_from

   !> Move by the small time `delta`: series that are right to rounding for |exponent*delta| <= 0.08.
   pure subroutine shift(self, response, delta)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: delta

      if (response%driven%count > 0) then
         call shift_driven(self, response, delta)
      else
         call shift_plain(self, response, delta)
      end if
   end subroutine shift

   !> Move by the small time `delta` where excitation acts on driven terms.
   pure subroutine shift_driven(self, response, delta)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: delta

      call take_tones(self, response, self%re, self%im)
      call shift_plain(self, response, delta)
      associate (first => response%driven%first + 1, n => response%terms)
         call response%driven%push_shortly(delta, abs(delta)*response%fastest <= tiny_angle, self%tone, self%re(first:n), &
                                           self%im(first:n))
      end associate
   end subroutine shift_driven

   !> The same without the excitation of driven terms.
   pure subroutine shift_plain(self, response, delta)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: delta

      real(wp) :: x, y, y2, re, im, factor
      integer :: i, j, k
      logical :: tiny_step

      self%tau = self%tau + delta
      tiny_step = abs(delta)*response%fastest <= tiny_angle
      do i = 1, response%amplitudes
         y = aimag(response%exponent(i))*delta
         y2 = y*y
         if (tiny_step) then
            re = 1.0_wp - y2*(0.5_wp - y2*(1.0_wp/24))
            im = y*(1.0_wp - y2*(1.0_wp/6 - y2*(1.0_wp/120)))
         else
            re = 1.0_wp - y2*(0.5_wp - y2*(1.0_wp/24 - y2*(1.0_wp/720 - y2*(1.0_wp/40320))))
            im = y*(1.0_wp - y2*(1.0_wp/6 - y2*(1.0_wp/120 - y2*(1.0_wp/5040 - y2*(1.0_wp/362880)))))
         end if
         if (i <= response%terms) then
            x = real(response%exponent(i))*delta
            if (tiny_step) then
               factor = 1.0_wp + x*(1.0_wp + x*(0.5_wp + x*(1.0_wp/6 + x*(1.0_wp/24 + x*(1.0_wp/120)))))
            else
               factor = exp(x)
            end if
            re = factor*re
            im = factor*im
         end if
         x = self%re(i)*re - self%im(i)*im
         self%im(i) = self%re(i)*im + self%im(i)*re
         self%re(i) = x
      end do
      do i = 1, response%rigid
         self%rigid(i) = self%rigid(i) + delta*(self%rate(i) + 0.5_wp*delta*response%rigid_force(i))
         self%rate(i) = self%rate(i) + delta*response%rigid_force(i)
      end do
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         block
            real(wp) :: from(k - j + 1)

            from = self%dense(j:k)
            call exponential_action(response%dense(i)%matrix, response%dense(i)%norm, delta, from, self%dense(j:k))
         end block
      end do
   end subroutine shift_plain

   !> Move dense states by a step of 2^-level s.
   pure subroutine step_dense(response, level, dense)
      type(response_t), intent(in) :: response
      integer, intent(in) :: level
      real(wp), intent(inout) :: dense(:)

      integer :: i

      do i = 1, size(response%dense)
         associate (j => response%first(i), k => response%first(i + 1) - 1)
            dense(j:k) = matmul(response%step_dense(j:k, j:k, level), dense(j:k))
         end associate
      end do
   end subroutine step_dense

   !> Add to driven terms what the excitation gives in `tau` s after `start`.
   pure subroutine add_excitation(start, response, tau, self)
      type(amplitudes_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      type(amplitudes_t), intent(inout) :: self

      complex(wp) :: factor(response%driven%first + 1:response%amplitudes)
      real(wp) :: re, im
      integer :: i

      do i = response%driven%first + 1, response%amplitudes
         call growth(response%exponent(i), tau, re, im)
         factor(i) = cmplx(re, im, wp)
      end do
      call take_tones(self, response, start%re, start%im)
      associate (driven => response%driven, first => response%driven%first + 1, n => response%terms)
         call driven%push(tau, factor(first:n), factor(n + 1:), self%tone, self%re(first:n), self%im(first:n))
      end associate
   end subroutine add_excitation

   !> Cosine and sine of each tone that acts on driven terms, from amplitudes (re, im), into the workspace.
   pure subroutine take_tones(self, response, re, im)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: re(:), im(:)

      integer :: t

      do t = 1, response%driven%tones
         self%tone(2*t - 1) = re(response%terms + t)
         self%tone(2*t) = im(response%terms + t)
      end do
   end subroutine take_tones

   !> Add to driven terms what the excitation gives in a step of 2^-level s, from the tones in the workspace.
   pure subroutine push_by_table(self, response, level)
      type(amplitudes_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      integer, intent(in) :: level

      associate (first => response%driven%first + 1, n => response%driven%count)
         call add_product(n, 2*response%driven%tones, response%push_re(:, :, level), self%tone, self%re(first:))
         call add_product(n, 2*response%driven%tones, response%push_im(:, :, level), self%tone, self%im(first:))
      end associate
   end subroutine push_by_table

   !> Enter the factors over 2^-level s into the table of the response.
   pure subroutine tabulate(response, level)
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level

      complex(wp) :: factor(response%amplitudes)
      integer :: i, j, k

      response%step_length(level) = scale(1.0_wp, -level)
      do i = 1, response%amplitudes
         call growth(response%exponent(i), response%step_length(level), response%step_re(i, level), response%step_im(i, level))
         factor(i) = cmplx(response%step_re(i, level), response%step_im(i, level), wp)
      end do
      associate (driven => response%driven)
         if (driven%count > 0) call driven%tabulate_push(response%step_length(level), factor(driven%first + 1:response%terms), &
                                                         factor(response%terms + 1:), response%push_re(:, :, level), &
                                                         response%push_im(:, :, level))
      end associate
      if (response%nx > 0) response%step_dense(:, :, level) = 0.0_wp
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         response%step_dense(j:k, j:k, level) = matrix_exponential(response%dense(i)%matrix, response%step_length(level))
      end do
      response%has_step(level) = .true.
   end subroutine tabulate

   !> Real and imaginary part of exp(exponent*tau); growth beyond the range of the numbers is held at its edge, where the
   !> caller sees a blow-up.
   pure subroutine growth(exponent, tau, re, im)
      complex(wp), intent(in) :: exponent
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: re, im

      real(wp) :: angle, factor

      angle = aimag(exponent)*tau
      re = cos(angle)
      im = sin(angle)
      if (.not. abs(real(exponent)) > 0.0_wp) return
      factor = exp(min(max(real(exponent)*tau, -700.0_wp), 200.0_wp))
      re = factor*re
      im = factor*im
   end subroutine growth

   !> Carry a disturbance z (2m) of the state through `tau`, s: the transition matrix of the mode, applied.
   pure subroutine carry_disturbance(response, tau, z)
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      complex(wp) :: none(response%tones)
      real(wp) :: im, re, out(size(z)), rate, rigid, x(response%nx)
      complex(wp) :: term
      integer :: i, m

      m = response%m
      out = 0.0_wp
      do i = 1, response%terms
         call growth(response%exponent(i), tau, re, im)
         term = cmplx(re, im, wp)*cmplx(dot_product(response%to_re(:, i), z), dot_product(response%to_im(:, i), z), wp)
         out = out + (response%from_re(:, i)*term%re + response%from_im(:, i)*term%im)
      end do
      do i = 1, response%rigid
         rigid = dot_product(response%rigid_mode(:, i), z(:m))
         rate = dot_product(response%rigid_mode(:, i), z(m + 1:))
         out(:m) = out(:m) + response%rigid_mode(:, i)*(rigid + tau*rate)
         out(m + 1:) = out(m + 1:) + response%rigid_mode(:, i)*rate
      end do
      none = (0.0_wp, 0.0_wp)
      do i = 1, size(response%dense)
         associate (part => response%dense(i), here => x(response%first(i):response%first(i + 1) - 1))
            call part%start(z, none, here)
            ! Of a disturbance there is no load.
            here(part%states + 1:) = 0.0_wp
            here = matmul(matrix_exponential(part%matrix, tau), here)
            call part%add_state(here, out)
         end associate
      end do
      z = out
   end subroutine carry_disturbance

end module razy_exact_closed_form_amplitudes
