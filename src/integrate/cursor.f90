!! A point on the closed form: amplitudes at a time of a segment, moved by steps of 2^-level or to any time.
!!
!! Steps multiply amplitudes by tabulated factors and serve the search for events; what is kept of an event is evaluated
!! from the start of the segment, so that the state between events does not depend on the steps.
module razy_integrate_cursor
   use razy_core_kinds, only: wp
   use razy_integrate_response, only: response_t, rows_t
   use razy_linalg_exponential, only: exponential_action, matrix_exponential
   implicit none(type, external)
   private

   public :: cursor_t, move_to, reserve, set_state, shift, size_of, state_of, step, value_of

   type :: cursor_t
      !> Time since the start of the segment, s.
      real(wp) :: tau = 0.0_wp
      !> Amplitudes of terms and tones, rigid modes and their rates, dense states.
      real(wp), allocatable :: re(:), im(:), rigid(:), rate(:), dense(:)
   end type cursor_t

contains

   !> Make room for a response; reuses what is there if it has the right size.
   pure subroutine reserve(self, response)
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response

      integer :: n

      n = size(response%exponent)
      if (allocated(self%re)) then
         if (size(self%re) == n .and. size(self%rigid) == response%rigid .and. size(self%dense) == response%nx) return
         deallocate (self%re, self%im, self%rigid, self%rate, self%dense)
      end if
      allocate (self%re(n), self%im(n), self%rigid(response%rigid), self%rate(response%rigid), self%dense(response%nx))
   end subroutine reserve

   !> Put the cursor at tau = 0 with the state z (2m) and the tones' phases (tones).
   pure subroutine set_state(self, response, z, cosine, sine)
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: z(:), cosine(:), sine(:)

      real(wp) :: rest(2*response%m), total
      integer :: i, j, m, n

      m = response%m
      n = response%terms
      self%tau = 0.0_wp
      do i = 1, 2*m
         total = z(i) - response%constant(i)
         do j = 1, response%tones
            total = total - (response%from_re(i, n + j)*cosine(j) + response%from_im(i, n + j)*sine(j))
         end do
         rest(i) = total
      end do
      do j = 1, n
         self%re(j) = dot_product(response%to_re(:, j), rest)
         self%im(j) = dot_product(response%to_im(:, j), rest)
      end do
      do j = 1, response%tones
         self%re(n + j) = cosine(j)
         self%im(n + j) = sine(j)
      end do
      do j = 1, response%rigid
         self%rigid(j) = dot_product(response%rigid_mode(:, j), rest(:m))
         self%rate(j) = dot_product(response%rigid_mode(:, j), rest(m + 1:))
      end do
      do j = 1, size(response%dense)
         call response%dense(j)%start(z, cosine, sine, self%dense(response%first(j):response%first(j + 1) - 1))
      end do
   end subroutine set_state

   !> The state z (2m) at the cursor.
   pure subroutine state_of(self, response, z)
      type(cursor_t), intent(in) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(out) :: z(:)

      integer :: j, m

      m = response%m
      z = response%constant
      do j = 1, size(self%re)
         z = z + (response%from_re(:, j)*self%re(j) + response%from_im(:, j)*self%im(j))
      end do
      do j = 1, response%rigid
         z(:m) = z(:m) + response%rigid_mode(:, j)*self%rigid(j)
         z(m + 1:) = z(m + 1:) + response%rigid_mode(:, j)*self%rate(j)
      end do
      do j = 1, size(response%dense)
         call response%dense(j)%add_state(self%dense(response%first(j):response%first(j + 1) - 1), z)
      end do
   end subroutine state_of

   !> The derivative of order `order` (0…4) of form `j` at the cursor.
   pure function value_of(rows, response, self, j, order) result(f)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(cursor_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp) :: f

      integer :: i

      f = 0.0_wp
      do i = 1, size(self%re)
         f = f + (rows%re(i, order, j)*self%re(i) + rows%im(i, order, j)*self%im(i))
      end do
      select case (order)
      case (0)
         f = f + rows%constant(j)
         do i = 1, response%rigid
            f = f + (rows%rigid_y(i, j)*self%rigid(i) + rows%rigid_v(i, j)*self%rate(i))
         end do
      case (1)
         do i = 1, response%rigid
            f = f + (rows%rigid_y(i, j)*self%rate(i) + rows%rigid_v(i, j)*response%rigid_force(i))
         end do
      case (2)
         do i = 1, response%rigid
            f = f + rows%rigid_y(i, j)*response%rigid_force(i)
         end do
      case default
         ! Rigid modes are parabolas.
      end select
      do i = 1, response%nx
         f = f + rows%dense(i, order, j)*self%dense(i)
      end do
   end function value_of

   !> Sum of the moduli of all that `value_of` is the sum of: its rounding is some epsilon of that.
   pure function size_of(rows, response, self, j, order) result(total)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(cursor_t), intent(in) :: self
      integer, intent(in) :: j, order
      real(wp) :: total

      integer :: i

      total = 0.0_wp
      if (order == 0) total = abs(rows%constant(j))
      do i = 1, size(self%re)
         total = total + rows%size0(i, j)*response%modulus(i)**order*sqrt(self%re(i)**2 + self%im(i)**2)
      end do
      do i = 1, response%rigid
         if (order == 0) total = total + abs(rows%rigid_y(i, j)*self%rigid(i)) + abs(rows%rigid_v(i, j)*self%rate(i))
         if (order == 1) total = total + abs(rows%rigid_y(i, j)*self%rate(i)) + abs(rows%rigid_v(i, j)*response%rigid_force(i))
      end do
      do i = 1, response%nx
         total = total + abs(rows%dense(i, order, j)*self%dense(i))
      end do
   end function size_of

   !> Move from `from` by 2^-level s; makes the table's entry when it is used for the first time.
   pure subroutine step(from, response, level, self)
      type(cursor_t), intent(in) :: from
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level
      type(cursor_t), intent(inout) :: self

      real(wp) :: h
      integer :: i

      if (.not. response%has_step(level)) call tabulate(response, level)
      h = scale(1.0_wp, -level)
      self%tau = from%tau + h
      do i = 1, size(from%re)
         self%re(i) = from%re(i)*response%step_re(i, level) - from%im(i)*response%step_im(i, level)
         self%im(i) = from%re(i)*response%step_im(i, level) + from%im(i)*response%step_re(i, level)
      end do
      do i = 1, response%rigid
         self%rigid(i) = from%rigid(i) + h*(from%rate(i) + 0.5_wp*h*response%rigid_force(i))
         self%rate(i) = from%rate(i) + h*response%rigid_force(i)
      end do
      if (response%nx > 0) self%dense = matmul(response%step_dense(:, :, level), from%dense)
   end subroutine step

   pure subroutine tabulate(response, level)
      type(response_t), intent(inout) :: response
      integer, intent(in) :: level

      complex(wp) :: factor
      integer :: i, j, k

      do i = 1, size(response%exponent)
         factor = growth(response%exponent(i), scale(1.0_wp, -level))
         response%step_re(i, level) = real(factor)
         response%step_im(i, level) = aimag(factor)
      end do
      if (response%nx > 0) response%step_dense(:, :, level) = 0.0_wp
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         response%step_dense(j:k, j:k, level) = matrix_exponential(response%dense(i)%matrix, scale(1.0_wp, -level))
      end do
      response%has_step(level) = .true.
   end subroutine tabulate

   !> Evaluate the closed form that starts at `start` at the time `tau` of the segment.
   pure subroutine move_to(start, response, tau, self)
      type(cursor_t), intent(in) :: start
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: tau
      type(cursor_t), intent(inout) :: self

      complex(wp) :: factor
      integer :: i, j, k

      self%tau = tau
      do i = 1, size(start%re)
         factor = growth(response%exponent(i), tau)
         self%re(i) = start%re(i)*real(factor) - start%im(i)*aimag(factor)
         self%im(i) = start%re(i)*aimag(factor) + start%im(i)*real(factor)
      end do
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

   !> Move by the small time `delta`: fifth-order Taylor factors, right to rounding for |exponent*delta| <= 3e-3.
   pure subroutine shift(self, response, delta)
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: delta

      complex(wp) :: x, a
      real(wp), allocatable :: dense(:)
      integer :: i, j, k

      self%tau = self%tau + delta
      do i = 1, size(self%re)
         x = response%exponent(i)*delta
         a = cmplx(self%re(i), self%im(i), wp)
         a = a + x*(a + x*0.5_wp*(a + x*(1.0_wp/3)*(a + x*0.25_wp*(a + x*0.2_wp*a))))
         self%re(i) = real(a)
         self%im(i) = aimag(a)
      end do
      do i = 1, response%rigid
         self%rigid(i) = self%rigid(i) + delta*(self%rate(i) + 0.5_wp*delta*response%rigid_force(i))
         self%rate(i) = self%rate(i) + delta*response%rigid_force(i)
      end do
      if (response%nx == 0) return
      dense = self%dense
      do i = 1, size(response%dense)
         j = response%first(i)
         k = response%first(i + 1) - 1
         call exponential_action(response%dense(i)%matrix, response%dense(i)%norm, delta, dense(j:k), self%dense(j:k))
      end do
   end subroutine shift

   !> exp(exponent*tau); growth beyond the range of the numbers is held at its edge, where the caller sees a blow-up.
   elemental function growth(exponent, tau) result(factor)
      complex(wp), intent(in) :: exponent
      real(wp), intent(in) :: tau
      complex(wp) :: factor

      real(wp) :: angle

      angle = aimag(exponent)*tau
      factor = exp(min(max(real(exponent)*tau, -700.0_wp), 600.0_wp))*cmplx(cos(angle), sin(angle), wp)
   end function growth

end module razy_integrate_cursor
