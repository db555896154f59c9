!! A step of a Runge-Kutta method, a strip of steps, or a moment: the state at any time of it, by the dense output of the steps.
module razy_runge_kutta_stretch
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_stepper, only: stepper_t
   implicit none(type, external)
   private

   public :: stretch_t

   !> The part [0, duration] of a step `h` that began at `start` of the field's time, or steps of `h` on average of a strip;
   !> `moment`: no step, but the state `stop`.
   type :: stretch_t
      type(field_t) :: field
      type(stepper_t) :: stepper
      real(wp) :: start = 0.0_wp, h = 0.0_wp, duration = 0.0_wp
      !> States at start and end of the part shown, and that looked at last (2m each).
      real(wp), allocatable :: z_start(:), z_stop(:), z(:)
      logical :: moment = .false., dense = .false.
      !> Steps, and if there is more than one of them, that which the stepper has loaded.
      integer :: steps = 1
      integer, private :: loaded = 0
   contains
      procedure :: make_room
      procedure :: take_strip
      procedure :: leave_strip
      procedure :: load_step
      procedure :: make_dense
      procedure :: look
      procedure :: state_at
   end type stretch_t

contains

   !> Make room for the machine of the field.
   subroutine make_room(self)
      class(stretch_t), intent(inout) :: self

      if (allocated(self%z)) deallocate (self%z, self%z_start, self%z_stop)
      allocate (self%z(2*self%field%m), self%z_start(2*self%field%m), self%z_stop(2*self%field%m), source=0.0_wp)
   end subroutine make_room

   !> See the first `steps` steps of the stepper's strip, which begins at `start` of the field's time.
   pure subroutine take_strip(self, start, steps)
      class(stretch_t), intent(inout) :: self
      real(wp), intent(in) :: start
      integer, intent(in) :: steps

      integer :: i

      self%start = start
      self%steps = steps
      self%loaded = steps
      self%dense = .false.
      self%moment = .false.
      associate (strip => self%stepper%strip)
         self%duration = strip%at(steps)
         self%h = self%duration/steps
         do i = 1, size(self%z)
            self%z_start(i) = strip%z(i, 0)
            self%z_stop(i) = strip%z(i, steps)
         end do
      end associate
   end subroutine take_strip

   !> Leave the stepper at the end of the steps, whatever has been looked at.
   pure subroutine leave_strip(self)
      class(stretch_t), intent(inout) :: self

      if (self%loaded /= self%steps) call self%stepper%load(self%field, self%start, self%steps)
      call self%stepper%go_to_end()
      self%steps = 1
   end subroutine leave_strip

   !> Have the dense output of the step that `tau` is in, `later` of its start.
   subroutine look_into_step(self, tau, later)
      class(stretch_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: later

      integer :: k

      later = tau
      if (self%steps > 1) then
         do k = 1, self%steps - 1
            if (tau <= self%stepper%strip%at(k)) exit
         end do
         call self%load_step(k)
         later = min(tau - self%stepper%strip%at(k - 1), self%stepper%h)
      end if
      call self%make_dense()
   end subroutine look_into_step

   !> Have the stepper at step k of the strip.
   subroutine load_step(self, k)
      class(stretch_t), intent(inout) :: self
      integer, intent(in) :: k

      if (self%steps == 1 .or. k == self%loaded) return
      call self%stepper%load(self%field, self%start, k)
      self%loaded = k
      self%dense = .false.
   end subroutine load_step

   !> Bring the state at `tau` into `z`.
   subroutine look(self, tau)
      class(stretch_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      real(wp) :: later

      if (self%moment .or. tau >= self%duration) then
         self%z = self%z_stop
      else if (tau <= 0.0_wp) then
         self%z = self%z_start
      else
         call look_into_step(self, tau, later)
         call self%stepper%at(later/self%stepper%h, self%z)
      end if
   end subroutine look

   !> Make the dense output of the step, unless it has been made.
   subroutine make_dense(self)
      class(stretch_t), intent(inout) :: self

      if (self%dense) return
      if (self%steps == 1) then
         call self%stepper%prepare_dense(self%field, self%start, self%z_start)
      else
         associate (strip => self%stepper%strip, before => self%loaded - 1)
            call self%stepper%prepare_dense(self%field, self%start + strip%at(before), strip%z(:, before))
         end associate
      end if
      self%dense = .true.
   end subroutine make_dense

   !> Time of the field and z at `tau`.
   subroutine state_at(self, tau, time, z)
      class(stretch_t), intent(inout) :: self
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: time, z(:)

      call self%look(tau)
      time = self%start + tau
      z = self%z
   end subroutine state_at

end module razy_runge_kutta_stretch
