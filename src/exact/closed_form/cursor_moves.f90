!! Motion of a point on the closed form: by steps of 2^-level or to any time.
!!
!! Steps multiply amplitudes by tabulated factors and serve the search for events; what is kept of an event is evaluated
!! from the start of the segment, so that the state between events does not depend on the steps.
module razy_exact_closed_form_cursor_moves
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_cursor, only: copy, cursor_t
   use razy_linalg_wide_sums, only: add_product, rotate, wide
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_step_table, only: growth, tabulate
   use razy_linalg_exponential, only: exponential_action
   implicit none(type, external)
   private

   public :: go_from, move_to, shift, step

   !> Times the fastest exponent, a shift for which short series do.
   real(wp), parameter :: tiny_angle = 3.0e-3_wp

contains

   !> Move from `from` by 2^-level s; makes the table's entry when it is used for the first time.
   pure subroutine step(from, response, level, self)
      type(cursor_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      type(cursor_t), intent(inout) :: self

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
      type(cursor_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      type(cursor_t), intent(inout) :: self

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
      type(cursor_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      logical, intent(in) :: coarsely
      real(wp), intent(inout) :: tau
      type(cursor_t), intent(inout) :: self

      real(wp) :: h, re, rest
      integer :: i, k

      call copy(from, response, self)
      rest = tau
      if (response%driven%count > 0) then
         call take_digits_driven(response, level, rest, self)
      else
         h = response%step_length(level)
         do k = level + 1, response%fine_level
            h = 0.5_wp*h
            if (rest < h) cycle
            rest = rest - h
            if (.not. response%has_step(k)) call tabulate(response, k)
            do i = 1, response%amplitudes
               re = self%re(i)*response%step_re(i, k) - self%im(i)*response%step_im(i, k)
               self%im(i) = self%re(i)*response%step_im(i, k) + self%im(i)*response%step_re(i, k)
               self%re(i) = re
            end do
            if (response%nx > 0) call step_dense(response, k, self%dense)
         end do
      end if
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
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: delta

      if (response%driven%count > 0) then
         call shift_driven(self, response, delta)
      else
         call shift_plain(self, response, delta)
      end if
   end subroutine shift

   !> Go by the binary digits of `rest` (s) below 2^-level where excitation acts on driven terms; what is left of it is smaller
   !> than a step of the finest level.
   pure subroutine take_digits_driven(response, level, rest, self)
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      real(wp), intent(inout) :: rest
      type(cursor_t), intent(inout) :: self

      real(wp) :: h, re
      integer :: i, k

      h = response%step_length(level)
      do k = level + 1, response%fine_level
         h = 0.5_wp*h
         if (rest < h) cycle
         rest = rest - h
         if (.not. response%has_step(k)) call tabulate(response, k)
         call take_tones(self, response, self%re, self%im)
         do i = 1, response%amplitudes
            re = self%re(i)*response%step_re(i, k) - self%im(i)*response%step_im(i, k)
            self%im(i) = self%re(i)*response%step_im(i, k) + self%im(i)*response%step_re(i, k)
            self%re(i) = re
         end do
         call push_by_table(self, response, k)
         if (response%nx > 0) call step_dense(response, k, self%dense)
      end do
   end subroutine take_digits_driven

   !> Move by the small time `delta` where excitation acts on driven terms.
   pure subroutine shift_driven(self, response, delta)
      type(cursor_t), intent(inout) :: self
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
      type(cursor_t), intent(inout) :: self
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
      type(cursor_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      type(cursor_t), intent(inout) :: self

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
      type(cursor_t), intent(inout) :: self
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
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      integer, intent(in) :: level

      associate (first => response%driven%first + 1, n => response%driven%count)
         call add_product(n, 2*response%driven%tones, response%push_re(:, :, level), self%tone, self%re(first:))
         call add_product(n, 2*response%driven%tones, response%push_im(:, :, level), self%tone, self%im(first:))
      end associate
   end subroutine push_by_table

end module razy_exact_closed_form_cursor_moves
