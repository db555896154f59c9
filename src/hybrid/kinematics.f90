!! What a machine's contacts see of its motion, and its acceleration without them, in coupled coordinates (razy_machine_coupled):
!!
!!     a = S f(t) - B y' - K y,   s_j = w_jᵀ y + c_j + Re(Σ e_jt e^{iω_t t}),   z = (y, y').
!!
!! Times `tau` are s after the start of the piece, whose phases `start_piece` forms to rounding; phases near the start of a step
!! are formed from those there.
module razy_hybrid_kinematics
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_linalg_pattern, only: find_profile
   use razy_machine_coupled, only: coupled_t, new_coupled
   use razy_machine_machine, only: machine_t, observe_contact_force
   implicit none(type, external)
   private

   public :: kinematics_t

   !> Angles below which phases are formed by series, short and long ones.
   real(wp), parameter :: small_angle = 0.12_wp, large_angle = 0.8_wp

   !> Steps from which phases are carried on; each adds a rounding.
   integer, parameter :: most_carried = 8

   type :: kinematics_t
      type(machine_t) :: machine
      type(coupled_t) :: coupled
      !> Coupled coordinates; z has 2m components.
      integer :: m = 0
      !> Contact directions (m, contacts), constant load (m), phasors of load (m, tones) and of s (contacts, tones).
      real(wp), allocatable :: w(:, :), load(:), load_re(:, :), load_im(:, :), error_re(:, :), error_im(:, :)
      !> Observables on y and y' (m, observables).
      real(wp), allocatable :: on_y(:, :), on_v(:, :)
      !> First and last row that matter in each column of B and K (m each).
      integer, allocatable :: first(:), last(:)
      !> Angular frequencies, rad/s; cosine and sine of the phases at the start of the piece (tones each).
      real(wp), allocatable :: omega(:), cosine(:), sine(:)
      !> Time of the start of the step and phases there (tones each); whether a tone loads the machine.
      real(wp) :: base = 0.0_wp
      real(wp), allocatable :: base_cosine(:), base_sine(:)
      logical :: loaded = .false.
      !> Steps since the phases were formed from the start of the piece.
      integer :: carried = 0
      !> Workspace: phases at the time `looked` of evaluation (tones each); s and s' (contacts each).
      real(wp) :: looked = 0.0_wp
      real(wp), allocatable :: c(:), d(:), s(:), rate(:)
   contains
      procedure :: take
      procedure :: start_piece
      procedure :: start_step
      procedure :: turn_phases
      procedure :: look_at_time
      procedure :: phase
      procedure :: look_at_error
      procedure :: look_at_contact
      procedure :: look_at_contacts
      procedure :: free_acceleration
      procedure :: second_rate
      procedure :: to_coordinates
   end type kinematics_t

contains

   !> Take a machine; `keep_all` follows every coordinate, not only those that contacts and observables feel.
   subroutine take(self, machine, keep_all, error)
      class(kinematics_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      logical, intent(in) :: keep_all
      type(error_t), allocatable, intent(out) :: error

      integer :: contacts, j, tones

      call new_coupled(self%coupled, machine, keep_all, error)
      if (allocated(error)) return
      self%machine = machine
      self%m = self%coupled%m
      call find_profile(self%coupled%stiffness, self%coupled%damping, self%first, self%last)
      contacts = size(machine%contact)
      tones = size(machine%tone)
      self%load = matmul(self%coupled%project, machine%load)
      self%load_re = matmul(self%coupled%project, real(machine%harmonic_load, wp))
      self%load_im = matmul(self%coupled%project, aimag(machine%harmonic_load))
      self%loaded = any(abs(self%load_re) + abs(self%load_im) > 0.0_wp)
      self%omega = machine%tone%omega
      if (allocated(self%w)) deallocate (self%w, self%error_re, self%error_im, self%s, self%rate, self%on_y, self%on_v)
      if (allocated(self%c)) deallocate (self%c, self%d, self%cosine, self%sine, self%base_cosine, self%base_sine)
      allocate (self%w(self%m, contacts), self%error_re(contacts, tones), self%error_im(contacts, tones))
      allocate (self%on_y(self%m, size(machine%observable)), self%on_v(self%m, size(machine%observable)), source=0.0_wp)
      allocate (self%s(contacts), self%rate(contacts), source=0.0_wp)
      allocate (self%c(tones), self%d(tones), self%cosine(tones), self%sine(tones), self%base_cosine(tones), &
                self%base_sine(tones), source=0.0_wp)
      do j = 1, contacts
         self%w(:, j) = matmul(self%coupled%project, machine%contact(j)%w)
         self%error_re(j, :) = real(machine%contact(j)%error, wp)
         self%error_im(j, :) = aimag(machine%contact(j)%error)
      end do
      do j = 1, size(machine%observable)
         if (machine%observable(j)%kind == observe_contact_force) cycle
         self%on_y(:, j) = matmul(self%coupled%project, machine%observable(j)%on_displacement)
         self%on_v(:, j) = matmul(self%coupled%project, machine%observable(j)%on_velocity)
      end do
   end subroutine take

   !> Form the phases of excitation at the time `time + time_low`, s, from which `tau` counts.
   pure subroutine start_piece(self, time, time_low)
      class(kinematics_t), intent(inout) :: self
      real(wp), intent(in) :: time, time_low

      integer :: t

      do t = 1, size(self%omega)
         call self%machine%tone(t)%phasor(time, time_low, self%cosine(t), self%sine(t))
      end do
      self%base = 0.0_wp
      self%looked = 0.0_wp
      self%c = self%cosine
      self%d = self%sine
      self%carried = 0
      self%base_cosine = self%cosine
      self%base_sine = self%sine
   end subroutine start_piece

   !> A step begins at tau: phases near it are formed from those there. These come from the step before, a few times, if that is
   !> near; then anew from the start of the piece. Those at the end of the step before have mostly been looked at.
   pure subroutine start_step(self, tau)
      class(kinematics_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      real(wp) :: cosine, sine
      integer :: t

      if (.not. abs(tau - self%base) > 0.0_wp) return
      self%carried = self%carried + 1
      do t = 1, size(self%omega)
         if (self%carried < most_carried .and. abs(tau - self%looked) <= 0.0_wp) then
            self%base_cosine(t) = self%c(t)
            self%base_sine(t) = self%d(t)
         else if (self%carried < most_carried .and. self%omega(t)*abs(tau - self%base) <= large_angle) then
            call self%phase(t, tau - self%base, cosine, sine)
            self%base_cosine(t) = cosine
            self%base_sine(t) = sine
         else
            cosine = cos(self%omega(t)*tau)
            sine = sin(self%omega(t)*tau)
            self%base_cosine(t) = self%cosine(t)*cosine - self%sine(t)*sine
            self%base_sine(t) = self%sine(t)*cosine + self%cosine(t)*sine
         end if
      end do
      self%base = tau
      if (self%carried >= most_carried) self%carried = 0
   end subroutine start_step

   !> Phases at tau into the workspace: those at the start of the step turned by the angles given by cosine and sine (tones each).
   pure subroutine turn_phases(self, cosine, sine, tau)
      class(kinematics_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: cosine(:), sine(:)
      real(wp), intent(in) :: tau

      integer :: t

      self%looked = tau
      do t = 1, size(self%omega)
         self%c(t) = self%base_cosine(t)*cosine(t) - self%base_sine(t)*sine(t)
         self%d(t) = self%base_sine(t)*cosine(t) + self%base_cosine(t)*sine(t)
      end do
   end subroutine turn_phases

   !> Phases at tau into the workspace.
   pure subroutine look_at_time(self, tau)
      class(kinematics_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      integer :: t

      if (.not. abs(tau - self%looked) > 0.0_wp) return
      self%looked = tau
      do t = 1, size(self%omega)
         call self%phase(t, tau - self%base, self%c(t), self%d(t))
      end do
   end subroutine look_at_time

   !> Cosine and sine of the phase of tone t at `later` s after the start of the step. The series are right to rounding.
   pure subroutine phase(self, t, later, c, d)
      class(kinematics_t), intent(in) :: self
      integer, intent(in) :: t
      real(wp), intent(in) :: later
      real(wp), intent(out) :: c, d

      real(wp) :: cosine, sine, x, x2

      x = self%omega(t)*later
      x2 = x*x
      if (abs(x) <= small_angle) then
         cosine = 1 - x2*(1.0_wp/2 - x2*(1.0_wp/24 - x2*(1.0_wp/720 - x2*(1.0_wp/40320 - x2*(1.0_wp/3628800)))))
         sine = x*(1 - x2*(1.0_wp/6 - x2*(1.0_wp/120 - x2*(1.0_wp/5040 - x2*(1.0_wp/362880)))))
      else if (abs(x) <= large_angle) then
         cosine = 1.0_wp/3628800 - x2*(1.0_wp/479001600 - x2*(1.0_wp/87178291200.0_wp - x2*(1.0_wp/20922789888000.0_wp)))
         cosine = 1 - x2*(1.0_wp/2 - x2*(1.0_wp/24 - x2*(1.0_wp/720 - x2*(1.0_wp/40320 - x2*cosine))))
         sine = 1.0_wp/39916800 - x2*(1.0_wp/6227020800.0_wp - x2*(1.0_wp/1307674368000.0_wp - x2*(1.0_wp/355687428096000.0_wp)))
         sine = x*(1 - x2*(1.0_wp/6 - x2*(1.0_wp/120 - x2*(1.0_wp/5040 - x2*(1.0_wp/362880 - x2*sine)))))
      else
         cosine = cos(x)
         sine = sin(x)
      end if
      c = self%base_cosine(t)*cosine - self%base_sine(t)*sine
      d = self%base_sine(t)*cosine + self%base_cosine(t)*sine
   end subroutine phase

   !> The parts of s and s' of contact j that do not depend on z, at the phases of the workspace.
   pure subroutine look_at_error(self, j, s, rate)
      class(kinematics_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(out) :: s, rate

      integer :: t

      s = self%machine%contact(j)%offset
      rate = self%machine%contact(j)%drive
      do t = 1, size(self%omega)
         s = s + (self%error_re(j, t)*self%c(t) - self%error_im(j, t)*self%d(t))
         rate = rate - self%omega(t)*(self%error_re(j, t)*self%d(t) + self%error_im(j, t)*self%c(t))
      end do
   end subroutine look_at_error

   !> s and s' of contact j at z and the phases of the workspace.
   pure subroutine look_at_contact(self, j, z)
      class(kinematics_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: z(:)

      real(wp) :: rate, s
      integer :: i

      call self%look_at_error(j, s, rate)
      do i = 1, self%m
         s = s + self%w(i, j)*z(i)
         rate = rate + self%w(i, j)*z(self%m + i)
      end do
      self%s(j) = s
      self%rate(j) = rate
   end subroutine look_at_contact

   !> Phases, s and s' of all contacts at (tau, z) into the workspace.
   pure subroutine look_at_contacts(self, tau, z)
      class(kinematics_t), intent(inout) :: self
      real(wp), intent(in) :: tau, z(:)

      integer :: j

      call self%look_at_time(tau)
      do j = 1, size(self%s)
         call self%look_at_contact(j, z)
      end do
   end subroutine look_at_contacts

   !> y'' (m) without any contact at z and the phases of the workspace.
   pure subroutine free_acceleration(self, z, a)
      class(kinematics_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: a(:)

      integer :: i, j, m, t

      m = self%m
      do i = 1, m
         a(i) = self%load(i)
      end do
      if (self%loaded) then
         do t = 1, size(self%omega)
            do i = 1, m
               a(i) = a(i) + (self%load_re(i, t)*self%c(t) - self%load_im(i, t)*self%d(t))
            end do
         end do
      end if
      do j = 1, m
         do i = self%first(j), self%last(j)
            a(i) = a(i) - (self%coupled%stiffness(i, j)*z(j) + self%coupled%damping(i, j)*z(m + j))
         end do
      end do
   end subroutine free_acceleration

   !> s'' of contact j at the acceleration a (m) and the phases of the workspace.
   pure function second_rate(self, j, a) result(rate)
      class(kinematics_t), intent(in) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: a(:)
      real(wp) :: rate

      integer :: i, t

      rate = 0.0_wp
      do i = 1, self%m
         rate = rate + self%w(i, j)*a(i)
      end do
      do t = 1, size(self%omega)
         rate = rate - self%omega(t)**2*(self%error_re(j, t)*self%c(t) - self%error_im(j, t)*self%d(t))
      end do
   end function second_rate

   !> Displacements and velocities (n each) of z; needs a machine taken with `keep_all`.
   pure subroutine to_coordinates(self, z, displacement, velocity)
      class(kinematics_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp), intent(out) :: displacement(:), velocity(:)

      displacement = matmul(z(:self%m), self%coupled%project)
      velocity = matmul(z(self%m + 1:), self%coupled%project)
   end subroutine to_coordinates

end module razy_hybrid_kinematics
