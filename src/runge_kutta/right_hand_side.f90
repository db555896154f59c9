!! The right-hand side of a machine's motion, z' = f(t, z) with z = (y, y'), for Runge-Kutta methods, with one of three treatments
!! of what is not smooth (source thesis, 3.3): by `event` the branches stay as they are, found and changed by others; with
!! `switching` they are looked up in every right-hand side, and friction sticks within a band; with `smoothing` every law is its
!! smoothed form.
module razy_runge_kutta_right_hand_side
   use razy_contact_contact_law, only: branch_sticking
   use razy_core_kinds, only: i8, wp
   use razy_core_tone, only: rate_of
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_mode, only: constrained, idle, lawful, press_of
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: right_hand_side_t
   public :: treat_by_events, treat_by_smoothing, treat_by_switching

   integer, parameter :: treat_by_events = 1, treat_by_switching = 2, treat_by_smoothing = 3

   type :: right_hand_side_t
      type(dynamics_t) :: dynamics
      integer :: treatment = treat_by_events
      !> Half width of the band of sticking in switched laws, m/s (rad/s).
      real(wp) :: band = 0.0_wp
      !> Right-hand sides and Jacobian matrices formed so far.
      integer(i8) :: evaluations = 0, jacobians = 0
      !> Whether the mode is y'' = f - (K B) z - Σ w F with few coordinates, no constraints and no friction that a contact presses.
      !> (K B) (m, 2m), constant part of f (m), its phasors (m, tones): with all forces that are affine.
      logical, private :: direct = .false.
      real(wp), allocatable, private :: matrix(:, :), load(:)
      complex(wp), allocatable, private :: harmonic(:, :)
      !> Contacts whose forces F are not, their directions (m, those), and the constants and phasors (tones, those) of s and s'.
      integer, allocatable, private :: lawful(:)
      real(wp), allocatable, private :: w(:, :), of_s(:), of_rate(:)
      complex(wp), allocatable, private :: tone_of_s(:, :), tone_of_rate(:, :)
   contains
      procedure :: enter
      procedure :: derivative
      procedure :: accelerate
      procedure :: jacobian
   end type right_hand_side_t

   !> The most coordinates for which a full matrix is cheaper than its parts.
   integer, parameter :: most_dense = 8

contains

   !> Make ready for the branches of the mode.
   subroutine enter(self, system)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: i, j

      associate (mode => self%dynamics%mode, m => system%m, tones => size(system%omega))
         call mode%enter(system)
         self%direct = .false.
         if (allocated(system%coupled%gyroscopic)) return
         if (self%treatment /= treat_by_events .or. m > most_dense .or. mode%constraints%count > 0) return
         self%lawful = pack(mode%acting(:mode%acts), mode%does(mode%acting(:mode%acts)) == lawful)
         do i = 1, size(self%lawful)
            if (system%machine%contact(self%lawful(i))%law%of_normal) return
         end do
         self%direct = .true.
         if (allocated(self%matrix)) deallocate (self%matrix, self%load, self%harmonic, self%w, self%of_s, self%of_rate, &
                                                 self%tone_of_s, self%tone_of_rate)
         associate (count => size(self%lawful))
            allocate (self%matrix(m, 2*m), self%load(m), self%harmonic(m, tones), self%w(m, count), self%of_s(count), &
                      self%of_rate(count), self%tone_of_s(tones, count), self%tone_of_rate(tones, count))
         end associate
         call mode%matrices(system, self%matrix(:, :m), self%matrix(:, m + 1:))
         call mode%loads(system, self%load, self%harmonic)
         do i = 1, size(self%lawful)
            j = self%lawful(i)
            self%w(:, i) = system%w(:, j)
            self%of_s(i) = system%gap(j)%constant
            self%of_rate(i) = system%machine%contact(j)%drive
            self%tone_of_s(:, i) = system%gap(j)%error
            self%tone_of_rate(:, i) = rate_of(system%machine%tone, system%gap(j)%error)
         end do
      end associate
   end subroutine enter

   !> z' (2m) at `tau` of the piece and z.
   subroutine derivative(self, system, tau, z, dz)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau
      real(wp), intent(in), contiguous :: z(:)
      real(wp), intent(out), contiguous :: dz(:)

      real(wp) :: force, rate, s
      integer :: i, k, m, tones

      m = system%m
      self%evaluations = self%evaluations + 1
      if (.not. self%direct) then
         dz(:m) = z(m + 1:)
         call self%accelerate(system, tau, z, dz(m + 1:))
         return
      end if
      call self%dynamics%excitation%look(system%machine%tone, tau)
      associate (phasor => self%dynamics%excitation%phasor)
         tones = size(phasor)
         call affine_part(m, tones, self%matrix, self%load, self%harmonic, phasor, z, dz)
         do i = 1, size(self%lawful)
            call look_at_gap(m, tones, self%w(:, i), self%of_s(i), self%tone_of_s(:, i), phasor, z, s)
            call look_at_gap(m, tones, self%w(:, i), self%of_rate(i), self%tone_of_rate(:, i), phasor, z(m + 1:), rate)
            associate (j => self%lawful(i))
               force = self%dynamics%stiffening(system, j) &
                       *system%machine%contact(j)%law%force(self%dynamics%mode%branch(j), s, rate, 0.0_wp)
            end associate
            do k = 1, m
               dz(m + k) = dz(m + k) - self%w(k, i)*force
            end do
         end do
      end associate
   end subroutine derivative

   !> z' (2m) of y'' = f - (K B) z.
   pure subroutine affine_part(m, tones, matrix, load, harmonic, phasor, z, dz)
      integer, intent(in) :: m, tones
      real(wp), intent(in) :: matrix(m, 2*m), load(m), z(2*m)
      complex(wp), intent(in) :: harmonic(m, tones), phasor(tones)
      real(wp), intent(out) :: dz(2*m)

      integer :: i, j

      do i = 1, m
         dz(i) = z(m + i)
         dz(m + i) = load(i)
      end do
      do j = 1, tones
         do i = 1, m
            dz(m + i) = dz(m + i) + (harmonic(i, j)%re*phasor(j)%re - harmonic(i, j)%im*phasor(j)%im)
         end do
      end do
      do j = 1, 2*m
         do i = 1, m
            dz(m + i) = dz(m + i) - matrix(i, j)*z(j)
         end do
      end do
   end subroutine affine_part

   !> w·y + constant + Re(Σ tone E).
   pure subroutine look_at_gap(m, tones, w, constant, tone, phasor, y, value)
      integer, intent(in) :: m, tones
      real(wp), intent(in) :: w(m), constant, y(m)
      complex(wp), intent(in) :: tone(tones), phasor(tones)
      real(wp), intent(out) :: value

      integer :: i

      value = constant
      do i = 1, m
         value = value + w(i)*y(i)
      end do
      do i = 1, tones
         value = value + (tone(i)%re*phasor(i)%re - tone(i)%im*phasor(i)%im)
      end do
   end subroutine look_at_gap

   !> y'' (m) there; leaves the forces of all contacts. Not counted as a right-hand side.
   subroutine accelerate(self, system, tau, z, a)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: a(:)

      if (self%treatment == treat_by_switching) call switch_branches(self, system, tau, z)
      call self%dynamics%accelerate(system, tau, z, a)
      if (self%treatment /= treat_by_switching) return
      do while (slipping(self%dynamics, system))
         call self%dynamics%mode%enter(system)
         call self%dynamics%accelerate(system, tau, z, a)
      end do
   end subroutine accelerate

   !> Look up the branches that the state z is in (`switching`): friction sticks within the band.
   subroutine switch_branches(self, system, tau, z)
      type(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)

      integer :: j

      associate (dynamics => self%dynamics, branch => self%dynamics%mode%branch)
         call dynamics%look_at_contacts(system, tau, z)
         do j = 1, size(branch)
            associate (law => system%machine%contact(j)%law)
               branch(j) = law%initial_branch(dynamics%s(j), dynamics%rate(j))
               if (law%constraint(branch_sticking) .and. abs(dynamics%rate(j)) <= self%band) branch(j) = branch_sticking
            end associate
         end do
         call dynamics%mode%enter(system)
      end associate
   end subroutine switch_branches

   !> Let slide what sticks with more than friction can hold (`switching`).
   function slipping(dynamics, system) result(any_did)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      logical :: any_did

      integer :: i, j

      any_did = .false.
      do i = 1, dynamics%mode%constraints%count
         j = dynamics%mode%constraints%contact(i)
         associate (guard => system%machine%contact(j)%law%force_guard(branch_sticking))
            if (guard%above /= 0 .and. dynamics%force(j) > guard%upper*dynamics%normal(j)) then
               dynamics%mode%branch(j) = guard%above
               any_did = .true.
            else if (guard%below /= 0 .and. dynamics%force(j) < guard%lower*dynamics%normal(j)) then
               dynamics%mode%branch(j) = guard%below
               any_did = .true.
            end if
         end associate
      end do
   end function slipping

   !> df/dz (2m, 2m) at `tau` of the piece and z.
   subroutine jacobian(self, system, tau, z, matrix)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: matrix(:, :)

      real(wp) :: a(system%m)
      integer :: i, m

      m = system%m
      self%jacobians = self%jacobians + 1
      call self%accelerate(system, tau, z, a)
      matrix = 0.0_wp
      do i = 1, m
         matrix(i, m + i) = 1.0_wp
      end do
      matrix(m + 1:, :m) = -system%coupled%stiffness
      matrix(m + 1:, m + 1:) = -system%coupled%damping
      if (allocated(system%coupled%gyroscopic)) then
         matrix(m + 1:, :m) = matrix(m + 1:, :m) - self%dynamics%speed_gained(system)*system%coupled%circulatory
         matrix(m + 1:, m + 1:) = matrix(m + 1:, m + 1:) - self%dynamics%speed_gained(system)*system%coupled%gyroscopic
      end if
      do i = 1, self%dynamics%mode%acts
         call add_slopes(self%dynamics, system, self%dynamics%mode%acting(i), matrix)
      end do
      if (self%dynamics%mode%constraints%count > 0) call constrain(self%dynamics, system, matrix)
   end subroutine jacobian

   !> Add the slopes of contact j, whose forces `accelerate` has left, to the matrix df/dz.
   subroutine add_slopes(dynamics, system, j, matrix)
      type(dynamics_t), intent(in) :: dynamics
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: per_normal, unused_1, unused_2

      associate (contact => system%machine%contact(j))
         call add(j, 1.0_wp)
         if (.not. contact%law%of_normal .or. contact%normal_of == 0) return
         associate (by => contact%normal_of, s => dynamics%s(j), rate => dynamics%rate(j), mode => dynamics%mode)
            if (any(mode%does(by) == [constrained, idle]) .or. .not. dynamics%is_in_play(system, j)) return
            if (mode%smoothed) then
               call contact%law%smoothed(s, rate, 1.0_wp, dynamics%sharpness, per_normal, unused_1, unused_2)
            else
               per_normal = contact%law%force(mode%branch(j), s, rate, 1.0_wp)
            end if
            call add(by, per_normal*press_of(mode%press(j), dynamics%force(by)))
         end associate
      end associate

   contains

      !> What `factor` times the force of contact `by` does in the direction of contact j.
      subroutine add(by, factor)
         integer, intent(in) :: by
         real(wp), intent(in) :: factor

         real(wp) :: damping, stiffness
         integer :: i, m

         m = system%m
         call dynamics%slopes_of(system, by, stiffness, damping)
         do i = 1, m
            matrix(m + 1:, i) = matrix(m + 1:, i) - factor*stiffness*system%w(:, j)*system%w(i, by)
            matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - factor*damping*system%w(:, j)*system%w(i, by)
         end do
      end subroutine add

   end subroutine add_slopes

   !> Take out of the rows y'' of df/dz what the constraint forces, with the friction that they press, let not happen.
   subroutine constrain(dynamics, system, matrix)
      type(dynamics_t), intent(in) :: dynamics
      type(system_t), intent(in) :: system
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: force(dynamics%mode%constraints%count), phi(dynamics%mode%constraints%couplings)
      integer :: i, j, k
      logical :: found

      associate (constraints => dynamics%mode%constraints, m => system%m, w => system%w)
         do i = 1, constraints%couplings
            j = constraints%sliding(i)
            phi(i) = system%machine%contact(j)%law%force(dynamics%mode%branch(j), dynamics%s(j), dynamics%rate(j), 1.0_wp)
         end do
         do k = 1, 2*m
            call constraints%solve(matmul(matrix(m + 1:, k), w(:, constraints%contact)), phi, force, found)
            if (.not. found) return
            matrix(m + 1:, k) = matrix(m + 1:, k) - matmul(w(:, constraints%contact), force)
            do i = 1, constraints%couplings
               matrix(m + 1:, k) = matrix(m + 1:, k) &
                                   - w(:, constraints%sliding(i))*(phi(i)*constraints%sign(i)*force(constraints%row(i)))
            end do
         end do
      end associate
   end subroutine constrain

end module razy_runge_kutta_right_hand_side
