!! The dense output of a step: z at theta in [0, 1] of it, and the path of one linear form of z.
!!
!! z(θ) = r_0 + θ(r_1 + (1-θ)(r_2 + θ(r_3 + (1-θ)(r_4 + …)))) (Hairer, Nørsett and Wanner I, II.6).
module razy_runge_kutta_methods_dense_output
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: dense_output_t, highest, path_t

   !> Most coefficients, counted from 0.
   integer, parameter :: highest = 7

   !> Coefficients r_0 … r_last (n each) of a step h.
   type :: dense_output_t
      integer :: last = 3
      real(wp) :: h = 0.0_wp
      real(wp), allocatable :: r(:, :)
   contains
      procedure :: prepare
      procedure :: at
      procedure :: follow
   end type dense_output_t

   !> The same for a scalar.
   type :: path_t
      integer :: last = 3
      real(wp) :: h = 0.0_wp, r(0:highest) = 0.0_wp
   contains
      procedure :: look => look_at_path
   end type path_t

contains

   !> Make room for n components and coefficients up to `last`.
   subroutine prepare(self, n, last)
      class(dense_output_t), intent(inout) :: self
      integer, intent(in) :: n, last

      self%last = last
      if (allocated(self%r)) then
         if (size(self%r, 1) /= n) deallocate (self%r)
      end if
      if (.not. allocated(self%r)) allocate (self%r(n, 0:highest))
      self%r = 0.0_wp
   end subroutine prepare

   !> z at theta.
   pure subroutine at(self, theta, z)
      class(dense_output_t), intent(in) :: self
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: z(:)

      real(wp) :: factor
      integer :: l

      z = self%r(:, self%last)
      do l = self%last - 1, 0, -1
         factor = merge(theta, 1.0_wp - theta, mod(l, 2) == 0)
         z = self%r(:, l) + factor*z
      end do
   end subroutine at

   !> The path of the form with the coefficients `on` of the components of z after the first `skipped`.
   pure subroutine follow(self, on, skipped, path)
      class(dense_output_t), intent(in) :: self
      real(wp), intent(in) :: on(:)
      integer, intent(in) :: skipped
      type(path_t), intent(inout) :: path

      integer :: i, l

      path%last = self%last
      path%h = self%h
      do l = 0, self%last
         path%r(l) = 0.0_wp
         do i = 1, size(on)
            path%r(l) = path%r(l) + on(i)*self%r(skipped + i, l)
         end do
      end do
   end subroutine follow

   !> Value of a path and its derivative by time at theta.
   pure subroutine look_at_path(self, theta, value, rate)
      class(path_t), intent(in) :: self
      real(wp), intent(in) :: theta
      real(wp), intent(out) :: value, rate

      real(wp) :: rest
      integer :: l

      value = self%r(self%last)
      rate = 0.0_wp
      rest = 1.0_wp - theta
      do l = self%last - 1, 0, -1
         if (iand(l, 1) == 0) then
            rate = theta*rate + value
            value = self%r(l) + theta*value
         else
            rate = rest*rate - value
            value = self%r(l) + rest*value
         end if
      end do
      rate = rate/self%h
   end subroutine look_at_path

end module razy_runge_kutta_methods_dense_output
