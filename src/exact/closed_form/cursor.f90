!! A point on the closed form: amplitudes at a time of a segment. Nothing is allocated here but by `reserve`, when a response is
!! larger than all before it.
module razy_exact_closed_form_cursor
   use razy_core_kinds, only: wp
   use razy_linalg_wide_sums, only: add_product, wide
   use razy_exact_closed_form_response, only: response_t
   implicit none(type, external)
   private

   public :: copy, cursor_t, reserve, set_state, state_of

   !> Arrays may be longer than the response at hand needs.
   type :: cursor_t
      !> Time since the start of the segment, s.
      real(wp) :: tau = 0.0_wp
      !> Amplitudes of terms and tones, rigid modes and their rates, dense states.
      real(wp), allocatable :: re(:), im(:), rigid(:), rate(:), dense(:)
      !> Workspace: cosine and sine of each tone.
      real(wp), allocatable :: tone(:)
   end type cursor_t

contains

   !> Make room for a response.
   pure subroutine reserve(self, response)
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response

      if (allocated(self%re)) then
         if (size(self%re) >= response%amplitudes .and. size(self%rigid) >= response%rigid &
             .and. size(self%dense) >= response%nx) return
         deallocate (self%re, self%im, self%rigid, self%rate, self%dense, self%tone)
      end if
      allocate (self%re(response%amplitudes + 8), self%im(response%amplitudes + 8))
      allocate (self%tone(2*(response%amplitudes + 8)))
      allocate (self%rigid(response%rigid + 8), self%rate(response%rigid + 8), self%dense(response%nx + 8))
   end subroutine reserve

   !> Put the cursor at tau = 0 with the state z (2m) and the tones' phases (tones).
   pure subroutine set_state(self, response, z, cosine, sine)
      type(cursor_t), intent(inout) :: self
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: z(:), cosine(:), sine(:)

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
            rest(i) = rest(i) - (response%from_re(i, n + j)*cosine(j) + response%from_im(i, n + j)*sine(j))
         end do
         self%re(n + j) = cosine(j)
         self%im(n + j) = sine(j)
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
         call response%dense(j)%start(z, cosine, sine, self%dense(response%first(j):response%first(j + 1) - 1))
      end do
   end subroutine set_state

   !> The state z (2m) at the cursor.
   pure subroutine state_of(self, response, z)
      type(cursor_t), intent(in) :: self
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
      type(cursor_t), intent(in) :: from
      type(response_t), intent(in) :: response
      type(cursor_t), intent(inout) :: to

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

end module razy_exact_closed_form_cursor
