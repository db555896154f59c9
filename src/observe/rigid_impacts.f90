!! Jumps of velocity at impacts of rigid contacts, seen from one piece of the motion to the next.
!!
!! Contacts that an event names and those that hold before and after it, with the friction that they press, may have impulses p in
!! their directions W: M Δq' = W p, so Δs' = Wᵀ M⁻¹ W p, and the kinetic energy of the relative motion changes by ½ pᵀ (s'₊ + s'₋).
!! What holds has Δs' = 0 and passes impulses on; other contacts have none, whatever their s'. Where directions depend on each other
!! the impulses are not known, and NaN.
module razy_observe_rigid_impacts
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dposv
   use razy_linalg_null_space, only: null_space, rank_bound
   use razy_machine_machine, only: contact_t, machine_t
   use razy_motion_integrator, only: integrator_t, piece_t
   implicit none(type, external)
   private

   public :: rigid_impacts_t

   !> Contacts that can jump (m) by number, Wᵀ M⁻¹ W (m, m); at the last event: which were hit, s' before and after and impulse
   !> (m each).
   type :: rigid_impacts_t
      integer, allocatable :: number(:)
      logical, allocatable :: jumped(:)
      real(wp), allocatable :: before(:), after(:), impulse(:)
      type(contact_t), allocatable, private :: contact(:)
      real(wp), allocatable, private :: mobility(:, :), w(:, :)
      !> What holds at the end of the piece before, and what the event there has named.
      logical, allocatable, private :: held(:), named(:)
      !> The largest rates before impacts so far.
      real(wp), allocatable, private :: fastest(:)
      logical, private :: begun = .false.
   contains
      procedure :: attach
      procedure :: look_before
      procedure :: look_after
   end type rigid_impacts_t

   !> A smaller jump, relative to the rates and to those before earlier impacts, is rounding, and so is a smaller impulse beside the
   !> others.
   real(wp), parameter :: smallest = 1.0e-9_wp

contains

   !> Take a machine.
   subroutine attach(self, machine)
      class(rigid_impacts_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine

      real(wp), allocatable :: factor(:, :), solved(:, :)
      integer :: info, j, m, n

      self%number = pack([(j, j=1, size(machine%contact))], [(machine%contact(j)%law%impacts .or. &
                                                              (machine%contact(j)%law%of_normal .and. &
                                                               .not. allocated(machine%contact(j)%frame)), &
                                                              j=1, size(machine%contact))])
      self%begun = .false.
      self%contact = machine%contact(self%number)
      m = size(self%number)
      self%jumped = [(.false., j=1, m)]
      self%held = self%jumped
      self%named = self%jumped
      self%before = [(0.0_wp, j=1, m)]
      self%after = self%before
      self%impulse = self%before
      self%fastest = self%before
      n = size(machine%mass, 1)
      if (m == 0) return
      self%w = reshape([(machine%contact(self%number(j))%w, j=1, m)], [n, m])
      factor = machine%mass
      solved = self%w
      call dposv("L", n, m, factor, n, solved, n, info)
      self%mobility = merge(matmul(transpose(self%w), solved), 0.0_wp, info == 0)
   end subroutine attach

   !> The rates with which a piece ends, or begins if impacts lie within, what holds, and what the event there names: pieces of no
   !> duration name more.
   subroutine look_before(self, part)
      class(rigid_impacts_t), intent(inout) :: self
      type(piece_t), intent(in) :: part

      self%named = self%named .or. self%number == part%contact
      if (.not. part%duration > 0.0_wp) return
      call look(self, part%by, merge(0.0_wp, part%duration, part%by%spreads_impacts), self%before, self%held)
      self%begun = .true.
   end subroutine look_before

   !> See which contacts were hit between the end of the piece before and `tau` of this one, and with what impulses.
   subroutine look_after(self, by, tau)
      class(rigid_impacts_t), intent(inout) :: self
      class(integrator_t), intent(inout) :: by
      real(wp), intent(in) :: tau

      logical, dimension(size(self%number)) :: holds, takes_part
      integer :: j

      call look(self, by, tau, self%after, holds)
      self%impulse = 0.0_wp
      holds = holds .and. self%held
      takes_part = self%named .or. holds
      do j = 1, size(holds)
         if (self%contact(j)%law%of_normal) takes_part(j) = any(takes_part .and. self%number == self%contact(j)%normal_of)
         if (holds(j)) self%after(j) = self%before(j)
      end do
      self%jumped = self%begun .and. self%named .and. takes_part .and. .not. holds .and. &
                    abs(self%after - self%before) > smallest*max(abs(self%after), abs(self%before), self%fastest)
      self%fastest = max(self%fastest, merge(abs(self%before), 0.0_wp, self%jumped))
      self%named = .false.
      if (.not. any(self%jumped)) return
      call find_impulses(self, pack([(j, j=1, size(holds))], takes_part))
   end subroutine look_after

   !> The impulses of those `who` take part: the shortest p, NaN where others do as well.
   subroutine find_impulses(self, who)
      class(rigid_impacts_t), intent(inout) :: self
      integer, intent(in) :: who(:)

      real(wp) :: factor(size(who), size(who)), p(size(who), 1)
      real(wp), allocatable :: free(:, :)
      integer :: info, j, k

      k = size(who)
      call null_space(transpose(self%w(:, who)), free, info)
      factor = self%mobility(who, who)
      factor = factor + sum([(factor(j, j), j=1, k)])*matmul(free, transpose(free))
      p = reshape(self%after(who) - self%before(who), [k, 1])
      if (info == 0) call dposv("L", k, 1, factor, k, p, k, info)
      self%jumped(who) = self%jumped(who) .and. abs(p(:, 1)) > smallest*maxval(abs(p))
      where (norm2(free, 2) > rank_bound .or. info /= 0) p(:, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
      self%impulse(who) = p(:, 1)
   end subroutine find_impulses

   !> Rates of all contacts, and which hold, at `tau`.
   subroutine look(self, by, tau, rates, holds)
      class(rigid_impacts_t), intent(in) :: self
      class(integrator_t), intent(inout) :: by
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rates(:)
      logical, intent(out) :: holds(:)

      real(wp) :: force, s
      integer :: j

      do j = 1, size(self%number)
         call by%contact(self%number(j), tau, s, rates(j), force)
         holds(j) = self%contact(j)%law%branch(by%branch(self%number(j)))%constraint
      end do
   end subroutine look

end module razy_observe_rigid_impacts
