!! Jumps of velocity at impacts of rigid contacts, seen from one piece of the motion to the next.
!!
!! Impulses p in the directions W of the contacts that jump give M Δq' = W p, so Δs' = Wᵀ M⁻¹ W p and the kinetic energy of the
!! relative motion changes by ½ pᵀ (s'₊ + s'₋). Where the directions depend on each other the impulses are not known, and NaN.
module razy_observe_rigid_impacts
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use razy_core_kinds, only: wp
   use razy_linalg_lapack, only: dpotrf, dpotrs
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: integrator_t
   implicit none(type, external)
   private

   public :: rigid_impacts_t

   !> Contacts that can jump (m) by number, Wᵀ M⁻¹ W (m, m); at the last jump: who jumped, s' before and impulse (m each).
   type :: rigid_impacts_t
      integer, allocatable :: number(:)
      real(wp), allocatable, private :: mobility(:, :)
      logical, allocatable :: jumped(:)
      real(wp), allocatable :: before(:), after(:), impulse(:)
      logical, private :: begun = .false.
   contains
      procedure :: attach
      procedure :: look_before
      procedure :: look_after
   end type rigid_impacts_t

   !> A smaller jump, relative to the rates, is rounding.
   real(wp), parameter :: smallest = 1.0e-9_wp

contains

   !> Take a machine.
   subroutine attach(self, machine)
      class(rigid_impacts_t), intent(inout) :: self
      type(machine_t), intent(in) :: machine

      real(wp), allocatable :: factor(:, :), solved(:, :), w(:, :)
      integer :: info, j, m, n

      self%number = pack([(j, j=1, size(machine%contact))], [(machine%contact(j)%law%impacts .or. &
                                                              (machine%contact(j)%law%of_normal .and. &
                                                               .not. allocated(machine%contact(j)%frame)), &
                                                              j=1, size(machine%contact))])
      self%begun = .false.
      m = size(self%number)
      self%jumped = [(.false., j=1, m)]
      self%before = [(0.0_wp, j=1, m)]
      self%after = self%before
      self%impulse = self%before
      n = size(machine%mass, 1)
      if (m == 0) return
      w = reshape([(machine%contact(self%number(j))%w, j=1, m)], [n, m])
      factor = machine%mass
      solved = w
      call dpotrf("L", n, factor, n, info)
      if (info == 0) call dpotrs("L", n, m, factor, n, solved, n, info)
      self%mobility = merge(matmul(transpose(w), solved), 0.0_wp, info == 0)
   end subroutine attach

   !> The rates with which a piece ends, at `tau`.
   subroutine look_before(self, by, tau)
      class(rigid_impacts_t), intent(inout) :: self
      class(integrator_t), intent(inout) :: by
      real(wp), intent(in) :: tau

      call look(self, by, tau, self%before)
      self%begun = .true.
   end subroutine look_before

   !> See whether rates jump from the end of the piece before to `tau` of this one, and with what impulses.
   subroutine look_after(self, by, tau)
      class(rigid_impacts_t), intent(inout) :: self
      class(integrator_t), intent(inout) :: by
      real(wp), intent(in) :: tau

      real(wp), allocatable :: factor(:, :), p(:, :)
      integer, allocatable :: who(:)
      integer :: info, j, k

      self%jumped = .false.
      if (.not. self%begun .or. size(self%number) == 0) return
      call look(self, by, tau, self%after)
      self%jumped = abs(self%after - self%before) > smallest*max(abs(self%after), abs(self%before))
      if (.not. any(self%jumped)) return
      who = pack([(j, j=1, size(self%number))], self%jumped)
      k = size(who)
      factor = self%mobility(who, who)
      p = reshape(self%after(who) - self%before(who), [k, 1])
      call dpotrf("L", k, factor, k, info)
      if (info == 0) info = count([(factor(j, j)**2 <= 64*epsilon(1.0_wp)*self%mobility(who(j), who(j)), j=1, k)])
      if (info == 0) call dpotrs("L", k, 1, factor, k, p, k, info)
      if (info /= 0) p = ieee_value(1.0_wp, ieee_quiet_nan)
      self%impulse(who) = p(:, 1)
   end subroutine look_after

   subroutine look(self, by, tau, rates)
      class(rigid_impacts_t), intent(in) :: self
      class(integrator_t), intent(inout) :: by
      real(wp), intent(in) :: tau
      real(wp), intent(out) :: rates(:)

      real(wp) :: force, s
      integer :: j

      do j = 1, size(self%number)
         call by%contact(self%number(j), tau, s, rates(j), force)
      end do
   end subroutine look

end module razy_observe_rigid_impacts
