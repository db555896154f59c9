!! The right-hand side of a machine's motion, z' = f(t, z) with z = (y, y') in coupled coordinates (razy_machine_coupled):
!!
!!     y'' = S f(t) - B y' - K y - Σ_j w_j F_j(s_j, s_j'),   s_j = w_jᵀ y + c_j + Re(Σ e_jt e^{iω_t t}).
!!
!! Times `tau` are s after the start of the piece, whose phases `start_piece` forms to rounding. The branches of all contacts
!! are `branch`; what a law does in a branch is the law's.
module razy_integrate_field
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_machine_coupled, only: coupled_t, new_coupled
   use razy_machine_machine, only: machine_t, observe_contact_force
   implicit none(type, external)
   private

   public :: field_t

   type :: field_t
      type(machine_t) :: machine
      type(coupled_t) :: coupled
      !> Coupled coordinates; z has 2m components.
      integer :: m = 0
      !> Contact directions (m, contacts), constant load (m), phasors of load (m, tones) and of s (contacts, tones).
      real(wp), allocatable :: w(:, :), load(:), load_re(:, :), load_im(:, :), error_re(:, :), error_im(:, :)
      !> Angular frequencies, rad/s; cosine and sine of the phases at the start of the piece (tones each).
      real(wp), allocatable :: omega(:), cosine(:), sine(:)
      integer, allocatable :: branch(:)
      !> Right-hand sides and Jacobian matrices formed so far.
      integer(i8) :: evaluations = 0, jacobians = 0
      !> Workspace: phases at the time of evaluation (tones each), s and s' (contacts each).
      real(wp), allocatable :: c(:), d(:), s(:), rate(:)
   contains
      procedure :: attach
      procedure :: start_piece
      procedure :: first_state
      procedure :: derivative
      procedure :: jacobian
      procedure :: look_at_contacts
      procedure :: observed
      procedure :: to_coordinates
   end type field_t

contains

   !> Take a machine; `keep_all` follows every coordinate, not only those that contacts and observables feel.
   subroutine attach(self, machine, keep_all, error)
      class(field_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: contacts, j, tones

      call new_coupled(self%coupled, machine, keep_all, error)
      if (allocated(error)) return
      self%machine = machine
      self%m = self%coupled%m
      contacts = size(machine%contact)
      tones = size(machine%tone)
      self%load = matmul(self%coupled%project, machine%load)
      self%load_re = matmul(self%coupled%project, real(machine%harmonic_load, wp))
      self%load_im = matmul(self%coupled%project, aimag(machine%harmonic_load))
      self%omega = machine%tone%omega
      if (allocated(self%w)) deallocate (self%w, self%error_re, self%error_im, self%branch, self%s, self%rate)
      if (allocated(self%c)) deallocate (self%c, self%d, self%cosine, self%sine)
      allocate (self%w(self%m, contacts), self%error_re(contacts, tones), self%error_im(contacts, tones))
      allocate (self%branch(contacts), source=1)
      allocate (self%s(contacts), self%rate(contacts), self%c(tones), self%d(tones), self%cosine(tones), self%sine(tones), &
                source=0.0_wp)
      do j = 1, contacts
         self%w(:, j) = matmul(self%coupled%project, machine%contact(j)%w)
         self%error_re(j, :) = real(machine%contact(j)%error, wp)
         self%error_im(j, :) = aimag(machine%contact(j)%error)
      end do
      self%evaluations = 0
      self%jacobians = 0
   end subroutine attach

   !> Form the phases of excitation at the time `time + time_low`, s, from which `tau` counts.
   pure subroutine start_piece(self, time, time_low)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_low

      integer :: t

      do t = 1, size(self%omega)
         call self%machine%tone(t)%phasor(time, time_low, self%cosine(t), self%sine(t))
      end do
   end subroutine start_piece

   !> z (2m) at the time 0, and the branches there.
   subroutine first_state(self, z)
      class(field_t), intent(inout) :: self
      real(wp), intent(out) :: z(:)

      integer :: j

      z(:self%m) = matmul(self%coupled%to_coupled, self%machine%displacement)
      z(self%m + 1:) = matmul(self%coupled%to_coupled, self%machine%velocity)
      call self%start_piece(0.0_wp, 0.0_wp)
      call self%look_at_contacts(0.0_wp, z)
      do j = 1, size(self%branch)
         self%branch(j) = self%machine%contact(j)%law%initial_branch(self%s(j), self%rate(j))
      end do
   end subroutine first_state

   !> Phases, s and s' of all contacts at (tau, z) into the workspace.
   pure subroutine look_at_contacts(self, tau, z)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)

      real(wp) :: cosine, sine
      integer :: i, j, t

      do t = 1, size(self%omega)
         cosine = cos(self%omega(t)*tau)
         sine = sin(self%omega(t)*tau)
         self%c(t) = self%cosine(t)*cosine - self%sine(t)*sine
         self%d(t) = self%sine(t)*cosine + self%cosine(t)*sine
      end do
      do j = 1, size(self%branch)
         self%s(j) = self%machine%contact(j)%offset
         self%rate(j) = self%machine%contact(j)%drive
         do i = 1, self%m
            self%s(j) = self%s(j) + self%w(i, j)*z(i)
            self%rate(j) = self%rate(j) + self%w(i, j)*z(self%m + i)
         end do
         do t = 1, size(self%omega)
            self%s(j) = self%s(j) + (self%error_re(j, t)*self%c(t) - self%error_im(j, t)*self%d(t))
            self%rate(j) = self%rate(j) - self%omega(t)*(self%error_re(j, t)*self%d(t) + self%error_im(j, t)*self%c(t))
         end do
      end do
   end subroutine look_at_contacts

   !> z' (2m) at (tau, z).
   subroutine derivative(self, tau, z, dz)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: dz(:)

      real(wp) :: force
      integer :: i, j, m, t

      m = self%m
      self%evaluations = self%evaluations + 1
      call self%look_at_contacts(tau, z)
      do i = 1, m
         dz(i) = z(m + i)
         dz(m + i) = self%load(i)
      end do
      do t = 1, size(self%omega)
         do i = 1, m
            dz(m + i) = dz(m + i) + (self%load_re(i, t)*self%c(t) - self%load_im(i, t)*self%d(t))
         end do
      end do
      do j = 1, m
         do i = 1, m
            dz(m + i) = dz(m + i) - (self%coupled%stiffness(i, j)*z(j) + self%coupled%damping(i, j)*z(m + j))
         end do
      end do
      do j = 1, size(self%branch)
         associate (contact => self%machine%contact(j))
            force = contact%law%force(self%branch(j), self%s(j), self%rate(j), contact%normal)
         end associate
         do i = 1, m
            dz(m + i) = dz(m + i) - self%w(i, j)*force
         end do
      end do
   end subroutine derivative

   !> df/dz (2m, 2m) at (tau, z).
   subroutine jacobian(self, tau, z, matrix)
      class(field_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: matrix(:, :)

      real(wp) :: stiffness, damping
      integer :: i, j, m

      m = self%m
      self%jacobians = self%jacobians + 1
      call self%look_at_contacts(tau, z)
      matrix = 0.0_wp
      do i = 1, m
         matrix(i, m + i) = 1.0_wp
      end do
      matrix(m + 1:, :m) = -self%coupled%stiffness
      matrix(m + 1:, m + 1:) = -self%coupled%damping
      do j = 1, size(self%branch)
         associate (contact => self%machine%contact(j))
            call contact%law%slopes(self%branch(j), self%s(j), self%rate(j), contact%normal, stiffness, damping)
         end associate
         do i = 1, m
            matrix(m + 1:, i) = matrix(m + 1:, i) - stiffness*self%w(:, j)*self%w(i, j)
            matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - damping*self%w(:, j)*self%w(i, j)
         end do
      end do
   end subroutine jacobian

   !> Observable `form` at (tau, z).
   function observed(self, form, tau, z) result(value)
      class(field_t), intent(inout) :: self
      integer, intent(in) :: form
      real(wp), intent(in) :: tau, z(:)
      real(wp) :: value

      integer :: t

      call self%look_at_contacts(tau, z)
      associate (observable => self%machine%observable(form))
         if (observable%kind == observe_contact_force) then
            associate (j => observable%contact, contact => self%machine%contact(observable%contact))
               value = contact%force_sign*contact%law%force(self%branch(j), self%s(j), self%rate(j), contact%normal)
            end associate
            return
         end if
         value = observable%constant + dot_product(matmul(self%coupled%project, observable%on_displacement), z(:self%m)) &
                 + dot_product(matmul(self%coupled%project, observable%on_velocity), z(self%m + 1:))
         do t = 1, size(self%omega)
            value = value + real(observable%error(t))*self%c(t) - aimag(observable%error(t))*self%d(t)
         end do
      end associate
   end function observed

   !> Displacements and velocities (n each) of z; needs a machine taken with `keep_all`.
   pure subroutine to_coordinates(self, z, displacement, velocity)
      class(field_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: displacement(:), velocity(:)

      displacement = matmul(z(:self%m), self%coupled%project)
      velocity = matmul(z(self%m + 1:), self%coupled%project)
   end subroutine to_coordinates

end module razy_integrate_field
