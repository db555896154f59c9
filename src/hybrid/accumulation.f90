!! Impacts of a rigid contact that follow each other ever faster (chatter to rest).
!!
!! Between impacts of a sequence with the restitution ρ < 1 under a relative acceleration -a that hardly changes, the speed after
!! impact n is u_n = ρ u_(n-1), the height of the flight u_n²/(2a), and all flights that are still to come take
!! T = Σ 2 u_n ρ^k/a = 2 u_n/(a (1 - ρ)). ρ is ε of a contact that is alone; where several work together it is not, and is measured.
!! A sequence is cut short when its flights are below the rounding of the first one's height (u_n² <= eps u_1²), or of the gap
!! itself: the speed of the gap is taken out by an impulse, the contact is held closed, and the end of the sequence is
!! reported T later. What is neglected is then below rounding of the path. The contact presses m (a T - u_n) in all that is still
!! to come and m a T while it is held, so friction that slides under it takes back its part of the impulse m u_n as well.
module razy_hybrid_accumulation
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t, new_constraints
   use razy_hybrid_field, only: field_t
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_transition, only: resolution_t
   implicit none(type, external)
   private

   public :: bounces_t

   !> The last impacts of every contact (contacts each): their number in the sequence, first and last speed, last ratio.
   type :: bounces_t
      integer, allocatable :: count(:)
      real(wp), allocatable :: first(:), last(:), ratio(:)
      !> Whether accumulations are on their way to their ends, whose, and when in the field's time; the first of these times;
      !> how many were reported last.
      logical :: landing = .false.
      logical, allocatable :: whose(:)
      real(wp), allocatable :: ends(:)
      real(wp) :: tau = 0.0_wp
      integer :: landed = 0
      real(wp), allocatable, private :: a(:)
   contains
      procedure :: attach
      procedure :: forget
      procedure :: count_from
      procedure :: gather
      procedure :: confirm
      procedure :: report
   end type bounces_t

   !> Ratios of one sequence differ by less than this part.
   real(wp), parameter :: steady = 0.01_wp

contains

   !> Make room for a machine.
   subroutine attach(self, field)
      class(bounces_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: n

      n = size(field%branch)
      if (allocated(self%count)) deallocate (self%count, self%first, self%last, self%ratio, self%whose, self%ends, self%a)
      allocate (self%count(n), self%first(n), self%last(n), self%ratio(n), self%whose(n), self%ends(n), self%a(field%m))
      call self%forget()
   end subroutine attach

   !> Forget all sequences.
   pure subroutine forget(self)
      class(bounces_t), intent(inout) :: self

      self%count = 0
      self%first = 0.0_wp
      self%last = 0.0_wp
      self%ratio = 0.0_wp
      self%whose = .false.
      self%landing = .false.
      self%ends = 0.0_wp
      self%tau = 0.0_wp
   end subroutine forget

   !> The field's time is counted from `tau` on.
   pure subroutine count_from(self, tau)
      class(bounces_t), intent(inout) :: self
      real(wp), intent(in) :: tau

      self%ends = self%ends - tau
      self%tau = self%tau - tau
   end subroutine count_from

   !> Take up the impacts of the event that `resolution` has just settled at (tau, z). Where sequences end, `gathered`, z loses the
   !> speeds of their gaps and the branches are settled again; the changes that are noted stay those of the event.
   subroutine gather(self, field, guards, resolution, tau, z, gathered)
      class(bounces_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(inout) :: guards
      type(resolution_t), intent(inout) :: resolution
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: gathered

      integer, dimension(size(resolution%contact)) :: branch, contact
      integer :: changes
      logical :: none(size(guards%entry))

      gathered = .false.
      if (resolution%impacts == 0) return
      call follow(self, field, guards, resolution%impacted, resolution%speed, resolution%direction, tau, z, gathered)
      if (.not. gathered) return
      none = .false.
      contact = resolution%contact
      branch = resolution%branch
      changes = resolution%changes
      call resolution%settle(field, guards, none, tau, z)
      resolution%contact = contact
      resolution%branch = branch
      resolution%changes = changes
      call self%confirm(field)
   end subroutine gather

   !> Follow the impacts at (tau, z) of the contacts `impacted`, whose gaps then open with `speed` in `direction` of s. If
   !> sequences end here, `gathered`, z is left without the speeds of their gaps.
   subroutine follow(self, field, guards, impacted, speed, direction, tau, z, gathered)
      type(bounces_t), intent(inout) :: self
      type(field_t), intent(inout) :: field
      type(guards_t), intent(in) :: guards
      logical, intent(in) :: impacted(:)
      real(wp), intent(in) :: speed(:), direction(:), tau
      real(wp), intent(inout) :: z(:)
      logical, intent(out) :: gathered

      integer :: j
      integer, allocatable :: list(:)
      real(wp) :: pull

      gathered = .false.
      allocate (list(0))
      call field%accelerate(tau, z, self%a)
      do j = 1, size(impacted)
         if (.not. impacted(j)) cycle
         call take_up(self, j, speed(j))
         pull = -direction(j)*field%second_rate(j, self%a)
         if (.not. ended(self, j, pull, guards%on_s(j), alone(self, field, j), field%machine%contact(j)%law%restitution)) cycle
         list = [list, j]
         self%whose(j) = .true.
         self%ends(j) = tau + 2*speed(j)/(pull*(1.0_wp - self%ratio(j)))
         self%count(j) = 0
      end do
      gathered = size(list) > 0
      if (.not. gathered) return
      call field%look_at_contacts(tau, z)
      call take_out(field, list, direction(list), z(field%m + 1:))
   end subroutine follow

   !> Take the speeds of the gaps of the contacts `list`, which open in `direction` of s, out of y' (m), with the friction that
   !> slides under them.
   subroutine take_out(field, list, direction, speed)
      type(field_t), intent(in) :: field
      integer, intent(in) :: list(:)
      real(wp), intent(in) :: direction(:)
      real(wp), intent(inout) :: speed(:)

      type(constraints_t) :: held
      real(wp) :: impulse(size(list))
      real(wp), allocatable :: phi(:)
      integer, allocatable :: row(:), sliding(:)
      integer :: i, j
      logical :: found

      allocate (sliding(0), row(0), phi(0))
      do j = 1, size(field%branch)
         associate (contact => field%machine%contact(j))
            if (.not. any(list == contact%normal_of) .or. .not. contact%law%of_normal) cycle
            if (contact%law%constraint(field%branch(j))) cycle
            sliding = [sliding, j]
            row = [row, findloc(list, contact%normal_of, 1)]
            phi = [phi, contact%law%force(field%branch(j), field%s(j), field%rate(j), 1.0_wp)]
         end associate
      end do
      call new_constraints(held, field%w, list, sliding, row, -direction(row))
      call held%solve(field%rate(list), phi, impulse, found)
      if (.not. found) then
         call held%displace(field%w, -field%rate(list), speed)
         return
      end if
      speed = speed - matmul(field%w(:, list), impulse)
      do i = 1, size(sliding)
         speed = speed + field%w(:, sliding(i))*(phi(i)*direction(row(i))*impulse(row(i)))
      end do
   end subroutine take_out

   !> An impact of contact j after which the gap opens with speed u.
   pure subroutine take_up(self, j, u)
      type(bounces_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: u

      real(wp) :: ratio

      ratio = 0.0_wp
      if (self%count(j) > 0 .and. self%last(j) > 0.0_wp) ratio = u/self%last(j)
      if (self%count(j) > 1 .and. abs(ratio - self%ratio(j)) > steady*self%ratio(j)) self%count(j) = 0
      if (ratio >= 1.0_wp .or. .not. u > 0.0_wp) self%count(j) = 0
      if (self%count(j) == 0) self%first(j) = u
      self%count(j) = self%count(j) + 1
      self%ratio(j) = ratio
      self%last(j) = u
      if (.not. u > 0.0_wp) self%count(j) = 0
   end subroutine take_up

   !> Whether no other contact has an impact, or is held, between the impacts of contact j.
   pure function alone(self, field, j)
      type(bounces_t), intent(in) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: j
      logical :: alone

      integer :: i

      alone = .true.
      do i = 1, size(field%branch)
         if (i == j) cycle
         if (self%count(i) > 0 .or. self%whose(i)) alone = .false.
         if (field%machine%contact(i)%law%constraint(field%branch(i))) alone = .false.
      end do
   end function alone

   !> Whether what is left of the sequence of contact j is below rounding; `pull` closes the gap, `noise` is the rounding of s. Of a
   !> contact that is alone, `single`, the ratio is the restitution; the last one measured has lost half of its digits.
   function ended(self, j, pull, noise, single, restitution)
      type(bounces_t), intent(inout) :: self
      integer, intent(in) :: j
      real(wp), intent(in) :: pull, noise, restitution
      logical, intent(in) :: single
      logical :: ended

      ended = .false.
      if (self%count(j) == 0 .or. .not. pull > 0.0_wp) return
      if (self%last(j)**2 <= 2*pull*16*noise) then
         if (self%count(j) < 3) self%ratio(j) = restitution
      else if (self%count(j) < 3 .or. self%last(j)**2 > epsilon(1.0_wp)*self%first(j)**2) then
         return
      end if
      if (single) self%ratio(j) = restitution
      ended = self%ratio(j) < 1.0_wp
   end function ended

   !> Keep of the sequences that are ending only those whose contacts the mode of the field holds closed.
   pure subroutine confirm(self, field)
      class(bounces_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: j

      do j = 1, size(self%whose)
         self%whose(j) = self%whose(j) .and. field%machine%contact(j)%law%constraint(field%branch(j))
      end do
      self%landing = any(self%whose)
      self%tau = minval(self%ends, mask=self%whose)
   end subroutine confirm

   !> Add the contacts whose sequences end at `tau`, closed as the field has them, to the changes.
   subroutine report(self, field, tau, resolution)
      class(bounces_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: tau
      type(resolution_t), intent(inout) :: resolution

      integer :: j

      call self%confirm(field)
      self%landed = 0
      do j = 1, size(self%whose)
         if (.not. self%whose(j) .or. self%ends(j) > tau) cycle
         self%landed = self%landed + 1
         self%whose(j) = .false.
         if (.not. any(resolution%contact(:resolution%changes) == j)) call resolution%note(j, field%branch(j))
      end do
      call self%confirm(field)
   end subroutine report

end module razy_hybrid_accumulation
