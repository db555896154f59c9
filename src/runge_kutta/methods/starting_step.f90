!! A step to start with.
module razy_runge_kutta_methods_starting_step
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   implicit none(type, external)
   private

   public :: starting_step

contains

   !> A step h, s, at most `longest`, from (tau, z), with the slope dz there, for a method of this order and its tolerances: by the
   !> size of z, z' and z'' (Hairer, Nørsett and Wanner I, II.4). `longest` is returned if there is no slope.
   subroutine starting_step(field, tau, z, dz, order, absolute, relative, longest, h)
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau, z(:), dz(:), absolute, relative, longest
      integer, intent(in) :: order
      real(wp), intent(out) :: h

      real(wp) :: there(size(z)), slope(size(z)), scale, size_z, size_f, size_change
      integer :: i

      h = longest
      size_z = 0.0_wp
      size_f = 0.0_wp
      do i = 1, size(z)
         if (.not. ieee_is_finite(dz(i))) return
         scale = absolute + relative*abs(z(i))
         size_z = max(size_z, abs(z(i))/scale)
         size_f = max(size_f, abs(dz(i))/scale)
      end do
      h = 1.0e-6_wp
      if (min(size_z, size_f) > 1.0e-5_wp) h = 0.01_wp*size_z/size_f
      h = min(h, longest)
      do i = 1, size(z)
         there(i) = z(i) + h*dz(i)
      end do
      call field%derivative(tau + h, there, slope)
      size_change = 0.0_wp
      do i = 1, size(z)
         if (.not. ieee_is_finite(slope(i))) return
         scale = absolute + relative*abs(z(i))
         size_change = max(size_change, abs(slope(i) - dz(i))/(scale*h))
      end do
      size_f = max(size_f, size_change)
      if (size_f > 1.0e-15_wp) then
         h = min(100*h, (0.01_wp/size_f)**(1.0_wp/order), longest)
      else
         h = min(max(1.0e-6_wp, 1.0e-3_wp*h), longest)
      end if
   end subroutine starting_step

end module razy_runge_kutta_methods_starting_step
