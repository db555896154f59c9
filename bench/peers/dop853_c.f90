!! The equations of the gear pair and the class of dop853 (numbalsoda's sources) for the peer dop853.cpp.
module dop853_c
   use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_f_procpointer, c_funptr, c_int, c_loc, c_ptr
   use dop853_module, only: dop853_class
   implicit none(type, external)
   private

   real(c_double), parameter :: inertia(4) = [0.1_c_double, 0.00794_c_double, 0.00794_c_double, 0.1_c_double]
   real(c_double), parameter :: shaft = 6.2905e4_c_double, damping_factor = 5e-4_c_double, radius = 0.08_c_double
   real(c_double), parameter :: error_sine = 5e-5_c_double, torque = 100.0_c_double

   abstract interface
      !> Called after each accepted step; 0 ends the integration there.
      function step_function(context, nr, t, y) result(go_on) bind(c)
         import :: c_double, c_int, c_ptr
         implicit none(type, external)
         type(c_ptr), value, intent(in) :: context
         integer(c_int), value, intent(in) :: nr
         real(c_double), value, intent(in) :: t
         real(c_double), intent(in) :: y(*)
         integer(c_int) :: go_on
      end function step_function
   end interface

   type, extends(dop853_class) :: solver_t
      procedure(step_function), pointer, nopass :: on_step => null()
      type(c_ptr) :: context
      real(c_double) :: omega = 0, stiffness = 0, shift = 0
   end type solver_t

contains

   function dop853_new() result(handle) bind(c)
      type(c_ptr) :: handle

      type(solver_t), pointer :: solver

      allocate (solver)
      handle = c_loc(solver)
   end function dop853_new

   subroutine dop853_free(handle) bind(c)
      type(c_ptr), value, intent(in) :: handle

      type(solver_t), pointer :: solver

      call c_f_pointer(handle, solver)
      deallocate (solver)
   end subroutine dop853_free

   !> Integrate from t on to t_end, or to where `on_step` ends it; the mesh force is stiffness * (d + shift).
   !> h: first step to try; comes back as the last one. Returns dop853's code: 1 at the end, 2 stopped, negative in failure.
   function dop853_run(handle, n, omega, stiffness, shift, t, y, t_end, rtol, atol, h, on_step, context) result(code) bind(c)
      type(c_ptr), value, intent(in) :: handle, context
      integer(c_int), value, intent(in) :: n
      real(c_double), value, intent(in) :: omega, stiffness, shift, t_end
      real(c_double), intent(inout) :: t, h
      real(c_double), intent(inout) :: y(n)
      real(c_double), intent(in) :: rtol(n), atol(n)
      type(c_funptr), value, intent(in) :: on_step
      integer(c_int) :: code

      type(solver_t), pointer :: solver
      logical :: ok
      integer :: i

      call c_f_pointer(handle, solver)
      if (n == 4) then
         call solver%initialize(n=n, fcn=relative_equations, solout=step, iprint=0, nstiff=0, nmax=100000000, hinitial=h, &
                                icomp=[(i, i=1, n)], status_ok=ok)
      else
         call solver%initialize(n=n, fcn=full_equations, solout=step, iprint=0, nstiff=0, nmax=100000000, hinitial=h, &
                                icomp=[(i, i=1, n)], status_ok=ok)
      end if
      code = -1
      if (.not. ok) return
      solver%omega = omega
      solver%stiffness = stiffness
      solver%shift = shift
      solver%context = context
      call c_f_procpointer(on_step, solver%on_step)
      call solver%integrate(t, y, t_end, rtol, atol, iout=2, idid=code)
      call solver%info(h=h)
   end function dop853_run

   !> Component i of the dense output.
   function dop853_dense(handle, i, t) result(y) bind(c)
      type(c_ptr), value, intent(in) :: handle
      integer(c_int), value, intent(in) :: i
      real(c_double), value, intent(in) :: t
      real(c_double) :: y

      type(solver_t), pointer :: solver

      call c_f_pointer(handle, solver)
      y = solver%contd8(i, t)
   end function dop853_dense

   subroutine step(me, nr, xold, x, y, irtrn, xout)
      class(dop853_class), intent(inout) :: me
      integer, intent(in) :: nr
      real(c_double), intent(in) :: xold, x
      real(c_double), dimension(:), intent(in) :: y
      integer, intent(inout) :: irtrn
      real(c_double), intent(out) :: xout

      xout = xold
      if (nr == 1) return
      select type (me)
      type is (solver_t)
         if (me%on_step(me%context, nr, x, y) == 0) irtrn = -1
      end select
   end subroutine step

   pure function force(me, t, closing)
      type(solver_t), intent(in) :: me
      real(c_double), intent(in) :: t, closing
      real(c_double) :: force

      force = 0
      if (me%stiffness > 0) force = me%stiffness*(radius*closing + error_sine*sin(me%omega*t) + me%shift)
   end function force

   subroutine full_equations(me, x, y, f)
      class(dop853_class), intent(inout) :: me
      real(c_double), intent(in) :: x
      real(c_double), dimension(:), intent(in) :: y
      real(c_double), dimension(:), intent(out) :: f

      real(c_double) :: torque1, torque2, mesh

      mesh = 0
      select type (me)
      type is (solver_t)
         mesh = radius*force(me, x, y(2) - y(3))
      end select
      torque1 = shaft*(y(1) - y(2) + damping_factor*(y(5) - y(6)))
      torque2 = shaft*(y(3) - y(4) + damping_factor*(y(7) - y(8)))
      f(1) = y(5)
      f(2) = y(6)
      f(3) = y(7)
      f(4) = y(8)
      f(5) = (torque - torque1)/inertia(1)
      f(6) = (torque1 - mesh)/inertia(2)
      f(7) = (mesh - torque2)/inertia(3)
      f(8) = (torque2 - torque)/inertia(4)
   end subroutine full_equations

   subroutine relative_equations(me, x, y, f)
      class(dop853_class), intent(inout) :: me
      real(c_double), intent(in) :: x
      real(c_double), dimension(:), intent(in) :: y
      real(c_double), dimension(:), intent(out) :: f

      real(c_double) :: both, mesh

      mesh = 0
      select type (me)
      type is (solver_t)
         mesh = radius*force(me, x, y(2))
      end select
      both = shaft*(y(1) - y(2) + damping_factor*(y(3) - y(4)))
      f(1) = y(3)
      f(2) = y(4)
      f(3) = (2*torque - both)/inertia(1)
      f(4) = (both - 2*mesh)/inertia(2)
   end subroutine relative_equations

end module dop853_c
