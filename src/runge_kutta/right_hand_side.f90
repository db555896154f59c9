!! The right-hand side of a machine's motion, z' = f(t, z) with z = (y, y'), for Runge-Kutta methods, with one of three treatments
!! of what is not smooth (source thesis, 3.3): by `event` the branches stay as they are, found and changed by others; with
!! `switching` they are looked up in every right-hand side, and friction sticks within a band; with `smoothing` every law is its
!! smoothed form.
module razy_runge_kutta_right_hand_side
   use razy_contact_friction_law, only: branch_sticking, strained_backward, strained_forward
   use razy_core_kinds, only: i8, wp
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_hybrid_mode, only: constrained, idle, lawful, mode_t, press_of
   use razy_hybrid_system, only: system_t
   use razy_linalg_blocks, only: filled
   implicit none(type, external)
   private

   public :: right_hand_side_t
   public :: treat_by_events, treat_by_smoothing, treat_by_switching

   integer, parameter :: treat_by_events = 1, treat_by_switching = 2, treat_by_smoothing = 3

   !> A mode of few coordinates, without constraints and friction that a contact presses, if it `is_one`. Then y'' = f - (K B) z
   !> - Σ w F with all forces that are affine in K and B; y'' without the others, and s and s' of their contacts, are the matrix
   !> times 1, z, and real and imaginary part of each phasor. Its rows are filled up to blocks.
   type :: direct_mode_t
      logical :: is_one = .false.
      integer, allocatable :: branch(:)
      real(wp), allocatable :: matrix(:, :)
      !> Those contacts.
      integer, allocatable :: lawful(:)
   end type direct_mode_t

   !> The most coordinates for which a full matrix is cheaper than its parts; modes of which it is kept.
   integer, parameter :: most_dense = 8, most_known = 8

   type :: right_hand_side_t
      type(dynamics_t) :: dynamics
      integer :: treatment = treat_by_events
      !> Half width of the band of sticking in switched laws, m/s (rad/s).
      real(wp) :: band = 0.0_wp
      !> Right-hand sides and Jacobian matrices formed so far.
      integer(i8) :: evaluations = 0, jacobians = 0
      !> The modes that are known of the machine with this version, the one that goes next, and the one at hand; 0: it is none.
      integer, private :: version = 0, oldest = 1, now = 0
      type(direct_mode_t), private :: known(most_known)
      real(wp), allocatable, private :: y(:)
   contains
      procedure :: enter
      procedure :: derivative
      procedure :: accelerate
      procedure :: force_of
      procedure :: jacobian
   end type right_hand_side_t

contains

   !> Make ready for the branches of the mode.
   subroutine enter(self, system)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: i

      call self%dynamics%mode%enter(system)
      self%now = 0
      if (allocated(system%coupled%by_speed)) return
      if (self%treatment /= treat_by_events .or. system%m > most_dense .or. self%dynamics%mode%constraints%count > 0) return
      if (self%version /= system%version) then
         self%version = system%version
         do i = 1, most_known
            if (allocated(self%known(i)%branch)) deallocate (self%known(i)%branch)
         end do
      end if
      do i = 1, most_known
         if (.not. allocated(self%known(i)%branch)) cycle
         if (all(self%known(i)%branch == self%dynamics%mode%branch)) exit
      end do
      if (i > most_known) then
         i = self%oldest
         self%oldest = modulo(i, most_known) + 1
         call form_matrix(self%known(i), system, self%dynamics%mode)
         if (.not. allocated(self%y)) allocate (self%y(0))
         if (size(self%y) < size(self%known(i)%matrix, 1)) self%y = self%known(i)%matrix(:, 0)
      end if
      if (self%known(i)%is_one) self%now = i
   end subroutine enter

   !> The matrix of a mode.
   subroutine form_matrix(self, system, mode)
      type(direct_mode_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode

      complex(wp) :: harmonic(system%m, size(system%omega))
      integer :: i, last

      associate (m => system%m, tones => size(system%omega))
         self%branch = mode%branch
         self%lawful = pack(mode%acting(:mode%acts), mode%does(mode%acting(:mode%acts)) == lawful)
         self%is_one = .not. any([(system%machine%contact(self%lawful(i))%law%of_normal &
                                   .or. allocated(system%machine%contact(self%lawful(i))%frame), i=1, size(self%lawful))])
         last = 2*(m + tones)
         if (allocated(self%matrix)) deallocate (self%matrix)
         allocate (self%matrix(filled(m + 2*size(self%lawful)), 0:last), source=0.0_wp)
         if (.not. self%is_one) return
         call mode%matrices(system, self%matrix(:m, 1:m), self%matrix(:m, m + 1:2*m))
         self%matrix(:m, 1:2*m) = -self%matrix(:m, 1:2*m)
         call mode%loads(system, self%matrix(:m, 0), harmonic)
         self%matrix(:m, 2*m + 1:last:2) = harmonic%re
         self%matrix(:m, 2*m + 2:last:2) = -harmonic%im
         do i = 1, size(self%lawful)
            call set_row(m + 2*i - 1, system%contact_form(self%lawful(i), 1.0_wp, 0.0_wp, 0.0_wp))
            call set_row(m + 2*i, system%contact_form(self%lawful(i), 0.0_wp, 1.0_wp, 0.0_wp))
         end do
      end associate

   contains

      subroutine set_row(i, form)
         integer, intent(in) :: i
         type(linear_form_t), intent(in) :: form

         associate (m => system%m)
            self%matrix(i, 0) = form%constant
            self%matrix(i, 1:m) = form%on_y
            self%matrix(i, m + 1:2*m) = form%on_v
            self%matrix(i, 2*m + 1:last:2) = form%error%re
            self%matrix(i, 2*m + 2:last:2) = -form%error%im
         end associate
      end subroutine set_row

   end subroutine form_matrix

   !> z' (2m) at `tau` of the piece and z.
   subroutine derivative(self, system, tau, z, dz)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(2*system%m)
      real(wp), intent(out) :: dz(2*system%m)

      real(wp) :: force
      integer :: i, j, m

      m = system%m
      self%evaluations = self%evaluations + 1
      if (self%now == 0) then
         dz(:m) = z(m + 1:)
         call self%accelerate(system, tau, z, dz(m + 1:))
         return
      end if
      call self%dynamics%excitation%look(system%machine%tone, tau)
      associate (mode => self%known(self%now))
         call linear_part(m, size(mode%matrix, 1), size(system%omega), mode%matrix, z, self%dynamics%excitation%phasor, self%y, dz)
         do i = 1, size(mode%lawful)
            j = mode%lawful(i)
            associate (contact => system%machine%contact(j))
               force = contact%law%force(self%dynamics%mode%branch(j), self%y(m + 2*i - 1), self%y(m + 2*i), 0.0_wp)
               if (allocated(contact%modulation)) force = self%dynamics%stiffened(system, j, force, self%y(m + 2*i))
            end associate
            dz(m + 1:) = dz(m + 1:) - system%w(:, j)*force
         end do
      end associate
   end subroutine derivative

   !> y = matrix (1, z, Re E, Im E), four rows at a time, and z' (2m) where y begins with y''.
   pure subroutine linear_part(m, rows, tones, matrix, z, phasor, y, dz)
      integer, intent(in) :: m, rows, tones
      real(wp), intent(in) :: matrix(rows, 0:2*(m + tones)), z(2*m)
      complex(wp), intent(in) :: phasor(tones)
      real(wp), intent(out) :: y(rows), dz(2*m)

      real(wp) :: part(4)
      integer :: i, j, t

      do i = 1, rows, 4
         part = matrix(i:i + 3, 0)
         do j = 1, 2*m
            part = part + matrix(i:i + 3, j)*z(j)
         end do
         do t = 1, tones
            j = 2*(m + t) - 1
            part = part + (matrix(i:i + 3, j)*phasor(t)%re + matrix(i:i + 3, j + 1)*phasor(t)%im)
         end do
         y(i:i + 3) = part
      end do
      dz(:m) = z(m + 1:)
      dz(m + 1:) = y(:m)
   end subroutine linear_part

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

   !> Reported force of contact j there; leaves s and s'. What no constraint and no other contact presses is looked at alone.
   function force_of(self, system, j, tau, z) result(force)
      class(right_hand_side_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(in) :: tau, z(:)
      real(wp) :: force

      real(wp) :: unused(system%m)

      force = 0.0_wp
      associate (dynamics => self%dynamics, contact => system%machine%contact(j))
         call dynamics%excitation%look(system%machine%tone, tau)
         if (self%treatment /= treat_by_switching .and. dynamics%mode%does(j) == idle) then
            call dynamics%look_at_contact(system, j, z)
         else if (self%treatment == treat_by_switching .or. dynamics%mode%does(j) == constrained .or. contact%law%of_normal) then
            call self%accelerate(system, tau, z, unused)
            call dynamics%look_at_contact(system, j, z)
         else
            call dynamics%look_at_force(system, j, z)
         end if
         if (dynamics%mode%does(j) /= idle) force = contact%force_sign*dynamics%force(j)
      end associate
   end function force_of

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
               if (law%of_normal .and. abs(dynamics%rate(j)) <= self%band) branch(j) = branch_sticking
            end associate
         end do
         call dynamics%mode%enter(system)
      end associate
   end subroutine switch_branches

   !> Strain the first friction that sticks with more than it can hold, or let it slide, if others do not hold it (`switching`).
   function slipping(dynamics, system) result(any_did)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      logical :: any_did

      integer :: i, j, way

      any_did = .false.
      do i = 1, dynamics%mode%constraints%count
         j = dynamics%mode%constraints%contact(i)
         associate (guard => system%machine%contact(j)%law%branch(branch_sticking)%force_guard, &
                    branch => dynamics%mode%branch(j), held => dynamics%mode%constraints)
            way = merge(1, 0, guard%above /= 0 .and. dynamics%force(j) > guard%upper*dynamics%normal(j)) &
                  - merge(1, 0, guard%below /= 0 .and. dynamics%force(j) < guard%lower*dynamics%normal(j))
            if (way == 0) cycle
            branch = merge(strained_forward, strained_backward, way > 0)
            call dynamics%mode%enter(system)
            if (norm2(held%free_part(dynamics%w, j)) > 0.0_wp) branch = merge(guard%above, guard%below, way > 0)
            any_did = .true.
            return
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
      if (allocated(system%coupled%by_speed)) then
         do i = 1, 2*m
            a = 0.0_wp
            a(mod(i - 1, m) + 1) = 1.0_wp
            matrix(m + 1:, i) = matrix(m + 1:, i) - system%coupled%by_speed%times(self%dynamics%speed_gained(system), 0, &
                                                                                  merge(1, 0, i <= m)*a, merge(1, 0, i > m)*a)
         end do
      end if
      do i = 1, self%dynamics%mode%acts
         call add_slopes(self%dynamics, system, self%dynamics%mode%acting(i), matrix)
      end do
      if (self%dynamics%mode%constraints%count == 0) return
      if (system%curved) then
         call difference(self%dynamics, system, tau, z, matrix)
      else
         call constrain(self%dynamics, system, matrix)
      end if
   end subroutine jacobian

   !> Add the slopes of contact j, whose forces `accelerate` has left, to the matrix df/dz.
   subroutine add_slopes(dynamics, system, j, matrix)
      type(dynamics_t), intent(in) :: dynamics
      type(system_t), intent(in) :: system
      integer, intent(in) :: j
      real(wp), intent(inout) :: matrix(:, :)

      real(wp) :: per_normal, unused_1, unused_2
      integer :: i

      associate (contact => system%machine%contact(j))
         call add(j, 1.0_wp)
         do i = 1, merge(system%m, 0, system%curved)
            matrix(system%m + 1:, i) = matrix(system%m + 1:, i) - dynamics%force(j)*dynamics%turned(:, j)*dynamics%around(i, j)
         end do
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
            matrix(m + 1:, i) = matrix(m + 1:, i) - factor*stiffness*dynamics%w(:, j)*dynamics%w(i, by)
            matrix(m + 1:, m + i) = matrix(m + 1:, m + i) - factor*damping*dynamics%w(:, j)*dynamics%w(i, by)
            if (.not. system%curved) cycle
            matrix(m + 1:, i) = matrix(m + 1:, i) - factor*damping*dynamics%swing(by)*dynamics%w(:, j)*dynamics%around(i, by)
         end do
      end subroutine add

   end subroutine add_slopes

   !> The rows y'' of df/dz by central differences: how the directions of constraints turn with the state is in them.
   subroutine difference(dynamics, system, tau, z, matrix)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(inout) :: matrix(:, :)

      real(wp), parameter :: part = 6.0e-6_wp
      real(wp) :: a(system%m, 2), step, there(size(z))
      integer :: i, k

      do i = 1, size(z)
         associate (m => system%m)
            step = part*max(norm2(merge(z(:m), z(m + 1:), i <= m)), tiny(1.0_wp)**0.25_wp)
         end associate
         do k = 1, 2
            there = z
            there(i) = z(i) + merge(-step, step, k == 1)
            call dynamics%accelerate(system, tau, there, a(:, k))
         end do
         matrix(system%m + 1:, i) = (a(:, 2) - a(:, 1))/(2*step)
      end do
      call dynamics%accelerate(system, tau, z, a(:, 1))
   end subroutine difference

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
