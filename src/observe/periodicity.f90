!! The kind of a motion: after how many periods of the excitation it repeats itself, and which contacts it touches.
!!
!! The motion is looked at once a period T, counted back from its end (Poincaré section). Its state there are the variables s
!! and T s'/2π of all contacts, or, of a machine without contacts, the linear observables; s without what it has from the drifts
!! of the machine (razy_machine_drift). It has the period k T if the states
!! of k successive sections, at least four, are those k sections before to a tolerance times the size of the state: the largest
!! |s| or T/2π Σ|w_i q_i'| of all contacts of the same unit, at four times in each of the last four periods and at all sections.
!! The sum is that of the terms of s', as a contact that stays closed has an s that is rounding. The smallest k is taken; the
!! drift is what the displacements differ by after it, along the drifts.
!!
!! A transient that dies away repeats itself nearly, too, after as many periods as its own vibration fits in. So
!! - a machine whose laws are piecewise linear and that has no event at the sections is linear: its motion settles to k = 1 or not;
!! - k > 1 needs states that differ clearly within the k periods, and stay where they are over half of the sections;
!! - what has no period is not settled while its differences from period to period still shrink, and not periodic otherwise.
module razy_observe_periodicity
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use, intrinsic :: iso_fortran_env, only: int64
   use razy_core_kinds, only: pi, wp
   use razy_core_table, only: common_unit, table_t
   use razy_machine_drift, only: drift_basis
   use razy_machine_excitation, only: period_of_loads
   use razy_machine_machine, only: machine_t, observe_linear
   use razy_motion_integrator, only: observer_t, piece_t
   implicit none(type, external)
   private

   public :: not_periodic, not_settled, periodicity_t, undetermined

   !> The largest k that is looked for, and what `found` says instead of it.
   integer, parameter :: longest = 32, not_periodic = 0, undetermined = -1, not_settled = -2
   !> Sections that are compared at least; periods whose quarters give the size of the state.
   integer, parameter :: fewest = 4, quartered = 4
   !> Sections without which a motion that has no period cannot be told from one on its way; periods of which the way is looked at.
   integer, parameter :: enough = 32, tried = 8
   !> Tolerances by which states have to differ to be two.
   real(wp), parameter :: clearly = 10.0_wp
   !> The last bit of `touched` stands for all contacts from this on.
   integer, parameter :: last_bit = 62

   type, extends(observer_t) :: periodicity_t
      real(wp) :: tolerance = 1.0e-6_wp
      !> The group of its columns.
      character(9) :: in_group = "/point/"
      !> From the start of recording on a bit for each contact that was closed, the first is bit 0.
      integer(int64) :: touched = 0_int64
      !> Names of the contacts, for the bits.
      character(64), allocatable, private :: name(:)
      !> Whether a contact is closed in a branch (branches, contacts).
      logical, allocatable, private :: closes(:, :)
      real(wp), private :: t_end = 0.0_wp, period = 0.0_wp
      integer, private :: contacts = 0, sections = 0, next = -1
      !> Whether all laws are piecewise linear, and no event was seen since the first section.
      logical, private :: linear = .false.
      !> Linear observables that are the state where there are no contacts; first contact of the same unit as each.
      integer, allocatable, private :: form(:), group(:)
      !> States (components, 0:sections), number 0 at the end of the motion; size of each component's group.
      real(wp), allocatable, private :: state(:, :), now(:), size(:)
      !> Directions of s or of the observable by displacement and velocity, moduli (n, contacts or observables each).
      real(wp), allocatable, private :: weight(:, :), rate_weight(:, :)
      !> Both directions of contacts in a plane, where the displacements in these stand for s and s' (n, contacts); 0 elsewhere.
      real(wp), allocatable, private :: in_plane(:, :), across(:, :)
      !> Whether the state is made of coordinates, by contacts in a plane or a drift.
      logical, private :: whole = .false.
      !> Basis D of the drifts (n, r), DᵀM (r, n), how far D moves the components (contacts or observables, r), DᵀM q at the
      !> sections (r, 0:sections); the unit of what drifts.
      real(wp), allocatable, private :: drifts(:, :), along(:, :), shift(:, :), gone(:, :)
      character(:), allocatable, private :: drift_unit
      !> Displacements and velocities (n each).
      real(wp), allocatable, private :: q(:), v(:)
   contains
      procedure :: attach
      procedure :: piece
      procedure :: found
      procedure :: drift
      procedure :: forget
      procedure :: columns
   end type periodicity_t

contains

   !> Begin anew with a motion of a machine until `t_end`, s.
   subroutine attach(self, machine, t_end)
      class(periodicity_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: t_end

      integer :: components, i, j

      self%touched = 0_int64
      self%t_end = t_end
      self%period = period_of_loads(machine)
      self%contacts = size(machine%contact)
      self%sections = 0
      if (self%period > 0.0_wp) self%sections = int(min(real(2*longest, wp), t_end/self%period))
      self%next = merge(4*self%sections, -1, self%sections > 0)
      self%linear = .true.
      self%form = [integer ::]
      self%group = [integer ::]
      if (allocated(self%name)) deallocate (self%name, self%closes, self%state, self%now, self%size, self%rate_weight, &
                                            self%in_plane, self%across, self%gone)
      allocate (self%name(self%contacts))
      allocate (self%closes(maxval([(size(machine%contact(j)%law%branch), j=1, self%contacts), 0]), self%contacts), source=.false.)
      do j = 1, self%contacts
         self%closes(:size(machine%contact(j)%law%branch), j) = machine%contact(j)%law%branch%closed
      end do
      if (self%contacts == 0) self%form = pack([(i, i=1, size(machine%observable))], machine%observable%kind == observe_linear)
      do j = 1, self%contacts
         self%name(j) = machine%contact(j)%name
         self%linear = self%linear .and. machine%contact(j)%law%piecewise_linear
         do i = 1, j
            if (machine%contact(i)%unit == machine%contact(j)%unit) exit
         end do
         self%group = [self%group, i]
      end do
      components = 2*self%contacts + size(self%form)
      allocate (self%state(components, 0:self%sections), self%now(components))
      allocate (self%size(components), source=0.0_wp)
      call attach_directions(self, machine)
   end subroutine attach

   !> Which coordinates the state is made of, and how a machine may drift.
   subroutine attach_directions(self, machine)
      type(periodicity_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine

      real(wp), allocatable :: direction(:, :)
      integer :: i, n

      n = size(machine%mass, 1)
      allocate (direction(n, self%contacts + size(self%form)))
      allocate (self%rate_weight(n, size(direction, 2)), self%in_plane(n, self%contacts), self%across(n, self%contacts), &
                source=0.0_wp)
      do i = 1, self%contacts
         direction(:, i) = machine%contact(i)%w
         if (.not. allocated(machine%contact(i)%frame)) cycle
         self%in_plane(:, i) = machine%contact(i)%w
         self%across(:, i) = machine%contact(i)%frame%across
      end do
      do i = 1, size(self%form)
         direction(:, self%contacts + i) = machine%observable(self%form(i))%on_displacement
         self%rate_weight(:, self%contacts + i) = abs(machine%observable(self%form(i))%on_velocity)
      end do
      self%weight = abs(direction)
      self%drifts = drift_basis(machine)
      self%along = matmul(transpose(self%drifts), machine%mass)
      self%shift = matmul(transpose(direction), self%drifts)
      self%whole = size(self%drifts, 2) > 0 .or. any(abs(self%across) > 0.0_wp)
      self%drift_unit = common_unit(pack(machine%unit, [(any(abs(self%drifts(i, :)) > 0.0_wp), i=1, n)]))
      allocate (self%gone(size(self%drifts, 2), 0:self%sections), source=0.0_wp)
      self%q = machine%displacement
      self%v = machine%velocity
   end subroutine attach_directions

   !> Take the sections in a piece, and the contacts that are closed in it.
   subroutine piece(self, part)
      class(periodicity_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      real(wp) :: tau

      tau = (self%t_end - part%time) - (part%time_low + part%duration)
      if (part%contact > 0 .and. tau < self%sections*self%period) self%linear = .false.
      if (part%time + (part%time_low + part%duration) > self%from) call touch(self, part)
      do while (self%next >= 0)
         tau = ((self%t_end - part%time) - part%time_low) - self%next*0.25_wp*self%period
         if (tau >= part%duration .and. .not. (part%last .and. self%next == 0)) return
         if (mod(self%next, 4) == 0 .or. self%next <= 4*quartered) call look(self, part, min(max(tau, 0.0_wp), part%duration))
         self%next = self%next - 1
      end do
   end subroutine piece

   !> Note which contacts are closed, or end the piece by touching or parting.
   subroutine touch(self, part)
      type(periodicity_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      integer :: j

      do j = 1, self%contacts
         if (.not. (self%closes(part%by%branch(j), j) .or. (j == part%contact .and. .not. part%last))) cycle
         self%touched = ibset(self%touched, min(j - 1, last_bit))
      end do
   end subroutine touch

   !> The state at `tau`, and its size; a whole number of periods before the end it is a section.
   subroutine look(self, part, tau)
      type(periodicity_t), intent(inout) :: self
      type(piece_t), intent(in) :: part
      real(wp), intent(in) :: tau

      real(wp) :: force, gone(size(self%drifts, 2)), rate, s
      integer :: i, j
      logical :: sized

      ! Many coordinates are asked for where they are needed alone.
      sized = self%next <= 4*quartered
      if (sized .or. self%whole) call part%by%state(tau, self%q, self%v)
      if (.not. sized) self%v = 0.0_wp
      gone = matmul(self%along, self%q)
      do j = 1, self%contacts
         call part%by%contact(j, tau, s, rate, force)
         if (any(abs(self%across(:, j)) > 0.0_wp)) then
            s = dot_product(self%in_plane(:, j), self%q)
            rate = dot_product(self%across(:, j), self%q)*(2*pi)/self%period
         end if
         s = s - dot_product(self%shift(j, :), gone)
         self%now(2*j - 1) = s
         self%now(2*j) = rate*self%period/(2*pi)
         i = 2*self%group(j)
         self%size(i) = max(self%size(i), abs(s), dot_product(self%weight(:, j), abs(self%v))*self%period/(2*pi), &
                            abs(self%now(2*j)))
      end do
      do i = 1, size(self%form)
         j = 2*self%contacts + i
         self%now(j) = part%by%value(self%form(i), tau) - dot_product(self%shift(self%contacts + i, :), gone)
         self%size(j) = max(self%size(j), abs(self%now(j)), dot_product(self%rate_weight(:, self%contacts + i), abs(self%v)), &
                            dot_product(self%weight(:, self%contacts + i), abs(self%v))*self%period/(2*pi))
      end do
      if (mod(self%next, 4) /= 0) return
      self%state(:, self%next/4) = self%now
      self%gone(:, self%next/4) = gone
   end subroutine look

   !> The period of the motion that was seen, as a multiple of that of the excitation; `not_periodic` if no multiple up to 32
   !> will do; `not_settled` if the motion is still on its way, or too short to tell; `undetermined` if there is no period of
   !> excitation, or the motion had less than five, or ended early.
   pure integer function found(self) result(multiple)
      class(periodicity_t), intent(in) :: self

      real(wp) :: limit(size(self%size))
      integer :: j, k

      multiple = undetermined
      if (self%next >= 0 .or. self%sections < fewest + 1 .or. size(self%size) == 0) return
      limit = self%tolerance*self%size
      do j = 1, self%contacts
         limit(2*j - 1:2*j) = self%tolerance*self%size(2*self%group(j))
      end do
      do k = 1, longest
         if (k + max(k, fewest) - 1 > self%sections) exit
         if (step_after(self, k, 0, max(k, fewest) - 1, limit) > 1.0_wp) cycle
         multiple = k
         if (k > 1) then
            if (self%linear .or. .not. stays(self, k, limit)) multiple = not_settled
         end if
         return
      end do
      multiple = merge(not_settled, not_periodic, self%linear .or. self%sections < enough .or. shrinks(self, limit))
   end function found

   !> How far the motion has gone after its period: of all coordinates the drift that is largest, m (rad); NaN without a period.
   pure real(wp) function drift(self)
      class(periodicity_t), intent(in) :: self

      real(wp), allocatable :: by(:)
      integer :: k

      k = self%found()
      drift = ieee_value(drift, ieee_quiet_nan)
      if (k < 1) return
      by = matmul(self%drifts, self%gone(:, 0) - self%gone(:, k))
      drift = by(maxloc(abs(by), dim=1))
   end function drift

   !> Largest difference between the sections `first` to `last` and those k before them, in limits.
   pure real(wp) function step_after(self, k, first, last, limit)
      type(periodicity_t), intent(in) :: self
      integer, intent(in) :: k, first, last
      real(wp), intent(in) :: limit(:)

      integer :: i

      step_after = 0.0_wp
      do i = first, last
         step_after = max(step_after, maxval(abs(self%state(:, i) - self%state(:, i + k))/max(limit, tiny(limit))))
      end do
   end function step_after

   !> Whether the k states that follow each other are apart, and where they were over half of the sections.
   pure logical function stays(self, k, limit)
      type(periodicity_t), intent(in) :: self
      integer, intent(in) :: k
      real(wp), intent(in) :: limit(:)

      integer :: j

      stays = .false.
      do j = 1, k - 1
         if (step_after(self, j, 0, k - 1, limit) < clearly) return
      end do
      do j = 2*k, self%sections/2, k
         if (step_after(self, j, 0, k - 1, limit) > 2.0_wp) return
      end do
      stays = .true.
   end function stays

   !> Whether the differences from period to period, or over some more, shrink: by half from the older half of the sections to
   !> the newer, or from each eighth to the next.
   pure logical function shrinks(self, limit)
      type(periodicity_t), intent(in) :: self
      real(wp), intent(in) :: limit(:)

      integer, parameter :: parts = 8
      real(wp) :: mean(parts)
      integer :: i, k, width

      shrinks = .true.
      do k = 1, tried
         width = (self%sections - k)/parts
         mean = [(mean_square(k, (i - 1)*width, i*width - 1), i=1, parts)]
         if (sum(mean(:parts/2)) < 0.25_wp*sum(mean(parts/2 + 1:))) return
         if (all(mean(:parts - 1) < mean(2:))) return
      end do
      shrinks = .false.

   contains

      pure real(wp) function mean_square(k, first, last)
         integer, intent(in) :: k, first, last

         integer :: i

         mean_square = 0.0_wp
         do i = first, last
            mean_square = mean_square + step_after(self, k, i, i, limit)**2/(last - first + 1)
         end do
      end function mean_square

   end function shrinks

   subroutine forget(self)
      class(periodicity_t), intent(inout) :: self

      self%sections = 0
      self%touched = 0_int64
   end subroutine forget

   !> Hand over period, drift and contacts touched, as single values.
   subroutine columns(self, table, machine)
      class(periodicity_t), intent(in) :: self
      type(table_t), intent(inout) :: table
      type(machine_t), intent(in) :: machine

      associate (unused => machine)
      end associate
      call table%add(trim(self%in_group)//"period", self%found(), "1", "period of the motion in periods of the excitation")
      call table%note("meanings", "0 = not periodic within 32, -1 = not determined, -2 = not settled")
      call table%add(trim(self%in_group)//"drift", self%drift(), self%drift_unit, "how far the motion goes on in its period")
      call table%add(trim(self%in_group)//"touched", self%touched, "1", "contacts touched, bit by bit")
      call table%note("names", self%name)
   end subroutine columns

end module razy_observe_periodicity
