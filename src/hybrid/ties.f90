!! Contacts that are tied: a side that touches, or friction that rests, whose force is on its bound while its acceleration is 0.
!!
!! With the direction d in which a tied contact leaves and the force x >= 0 that it gives beyond it (for friction at its limit:
!! less than the limit), the derivatives of the motion in which all tied contacts leave, with the forces of their bounds, obey
!!
!!     0 <= x ⟂ dᵀ y⁽ⁿ⁾ + e⁽ⁿ⁾ + G x >= 0
!!
!! for the first n >= 2 at which one is not 0. Who leaves there has left, who needs a force there is held; those for whom both are
!! 0 are decided by the next derivative, and so on. What is 0 in all derivatives that are known stays as it was.
!!
!! Where more is held than there are directions, as between bodies that two stops or two clutches join, forces are not unique.
!! Those of least norm are taken as long as none of them is beyond its bound; if one is or comes to be, and others hold it anyway,
!! it keeps the force of its bound, and stays at rest without being held.
!!
!! Friction that weakens as it begins to slide has no such problem, as its force jumps: all that leaves its limit lets go, and
!! everything is decided again without it. So does friction that nothing presses yet, where its force grows before its limit does.
!!
!! A compliant contact that rests on a bound goes the way of its first derivative that is not 0, too: the higher derivatives that
!! decide others are those in the branch that it goes to.
module razy_hybrid_ties
   use razy_contact_friction_law, only: branch_backward, branch_forward, branch_sticking, strained_backward, &
                                        strained_forward
   use razy_core_kinds, only: wp
   use razy_hybrid_active_sides, only: weakens
   use razy_hybrid_derivatives, only: derivatives_t, differentiate, response_to
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_guards, only: guards_t
   use razy_hybrid_system, only: system_t
   use razy_linalg_complementarity_friction, only: solve_impact
   use razy_linalg_complementarity_impact, only: impact_problem_t
   implicit none(type, external)
   private

   public :: break_ties, noise_of, tie_t

   !> A tied contact: its branches when held and when it has left, the sign of s in which it leaves, whether it was its guard that
   !> was left, so that it goes if nothing else decides, and whether it is friction that nothing presses yet.
   type :: tie_t
      integer :: contact = 0, held = 0, free = 0
      real(wp) :: direction = 0.0_wp
      logical :: left = .false., unpressed = .false.
   end type tie_t

   !> Derivatives that are asked for, and their rounding in units of the size of their terms.
   integer, parameter :: highest = 9
   real(wp), parameter :: rounding = 256*epsilon(1.0_wp)

contains

   !> What of s⁽ⁿ⁾ of contact j is rounding.
   pure function noise_of(derivatives, system, j, n) result(noise)
      type(derivatives_t), intent(in) :: derivatives
      type(system_t), intent(in) :: system
      integer, intent(in) :: j, n
      real(wp) :: noise

      noise = rounding*(system%reach(j)*derivatives%size(n) + derivatives%error(j, n))
   end function noise_of

   !> Put the branches of `tie`, which are held, and of compliant contacts that rest on a bound, in the mode of `dynamics` at
   !> (tau, z); `guards` know what is rounding. `loose` (contacts): friction that begins to slide with less than it stuck with, in
   !> the branch that it slides in.
   subroutine break_ties(system, dynamics, tau, z, guards, tie, loose)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:)
      type(guards_t), intent(in) :: guards
      type(tie_t), intent(in) :: tie(:)
      logical, intent(out) :: loose(:)

      type(derivatives_t) :: derivatives
      logical :: jumps(size(tie)), rests(size(dynamics%s)), tied(size(tie))
      integer :: branch(size(dynamics%s)), i, j, n

      loose = .false.
      rests = [(beyond(system, dynamics, guards, j, 1.0_wp) /= beyond(system, dynamics, guards, j, -1.0_wp), &
                j=1, size(rests))]
      do i = 1, size(tie)
         jumps(i) = tie(i)%held == branch_sticking
         if (jumps(i)) jumps(i) = tie(i)%unpressed .or. weakens(system%machine%contact(tie(i)%contact), tie(i)%free)
         if (.not. jumps(i)) dynamics%mode%branch(tie(i)%contact) = tie(i)%free
      end do
      tied = .not. jumps
      n = 2
      do while (any(tied) .or. any(rests))
         call dynamics%mode%enter(system)
         call differentiate(derivatives, system, dynamics, tau, z, guards%seen, highest)
         if (n > derivatives%highest) exit
         branch = dynamics%mode%branch
         call part(system, dynamics, derivatives, n, tie, tied)
         if (any(dynamics%mode%branch /= branch)) cycle
         do j = 1, size(rests)
            if (.not. rests(j) .or. abs(derivatives%s(j, n)) <= noise_of(derivatives, system, j, n)) cycle
            dynamics%mode%branch(j) = beyond(system, dynamics, guards, j, sign(1.0_wp, derivatives%s(j, n)))
            rests(j) = .false.
         end do
         n = n + 1
      end do
      do i = 1, size(tie)
         ! The other side of a contact without clearance may be what holds it.
         associate (branch => dynamics%mode%branch(tie(i)%contact))
            if (tied(i) .and. .not. tie(i)%left .and. branch == tie(i)%free) branch = tie(i)%held
         end associate
      end do
      ! Friction that weakens holds what is tied although it may let go: that is no decision.
      call share(system, dynamics, tau, z, guards%seen, tie, tied .and. .not. (tie%left .or. any(jumps)))
      call find_loose(system, dynamics, tau, z, guards%seen, tie, jumps, loose)
   end subroutine break_ties

   !> The branch of a compliant contact j that is at rest as it begins to move in a `direction`; 0 for all others. What remembers
   !> is left at its bound by an event of its own.
   pure function beyond(system, dynamics, guards, j, direction) result(branch)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: j
      real(wp), intent(in) :: direction
      integer :: branch

      real(wp) :: rate, s
      integer :: next

      branch = 0
      associate (law => system%machine%contact(j)%law, on_s => guards%on_s(j), on_rate => guards%on_rate(j))
         if (law%impacts .or. law%of_normal .or. law%remembers .or. abs(dynamics%rate(j)) > on_rate) return
         ! Beyond what is rounding of a bound, and no farther than that.
         s = dynamics%s(j) + direction*3*on_s
         rate = direction*(3*on_rate + sqrt(tiny(1.0_wp)))
         next = dynamics%mode%branch(j)
         do while (next /= 0)
            branch = next
            next = law%branch_beyond(branch, s, rate, on_s, on_rate)
         end do
      end associate
   end function beyond

   !> Decide of those that are `tied` whom derivative n decides, and put their branches in the mode.
   subroutine part(system, dynamics, derivatives, n, tie, tied)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(derivatives_t), intent(in) :: derivatives
      integer, intent(in) :: n
      type(tie_t), intent(in) :: tie(:)
      logical, intent(inout) :: tied(:)

      type(impact_problem_t) :: problem
      integer, allocatable :: list(:)
      real(wp), allocatable :: d(:, :), force(:), noise(:), u(:)
      integer :: i
      logical :: found

      list = pack([(i, i=1, size(tie))], tied)
      associate (which => tie(list))
         problem%drift = which%direction*derivatives%s(which%contact, n)
         noise = [(noise_of(derivatives, system, which(i)%contact, n), i=1, size(list))]
         if (all(abs(problem%drift) <= noise)) return
         allocate (d(system%m, size(list)), problem%delassus(size(list), size(list)), force(size(list)))
         allocate (problem%before(size(list)), problem%restitution(size(list)), source=0.0_wp)
         allocate (problem%coefficient(0, size(list)), problem%limit(0), source=0.0_wp)
         do i = 1, size(list)
            d(:, i) = which(i)%direction*dynamics%w(:, which(i)%contact)
         end do
         do i = 1, size(list)
            problem%delassus(:, i) = matmul(response_to(system, dynamics, pressing(which(i), d(:, i))), d)
         end do
         call solve_impact(problem, force, found)
         if (.not. found) return
         u = problem%drift + matmul(problem%delassus, force)
         noise = noise + sqrt(epsilon(1.0_wp))*maxval(noise)
         do i = 1, size(list)
            if (u(i) > noise(i)) then
               tied(list(i)) = .false.
            else if (force(i)*problem%delassus(i, i) > noise(i)) then
               tied(list(i)) = .false.
               dynamics%mode%branch(which(i)%contact) = which(i)%held
            end if
         end do
      end associate

   contains

      !> The direction of the force of a contact, with that of the friction that slides under it.
      function pressing(one, along) result(direction)
         type(tie_t), intent(in) :: one
         real(wp), intent(in) :: along(:)
         real(wp) :: direction(size(along))

         integer :: j

         direction = along
         if (one%held == branch_sticking) return
         do j = 1, size(dynamics%s)
            associate (contact => system%machine%contact(j), branch => dynamics%mode%branch(j))
               if (contact%normal_of /= one%contact .or. all(branch /= [branch_forward, branch_backward])) cycle
               direction = direction - dynamics%w(:, j)*contact%law%force(branch, dynamics%s(j), dynamics%rate(j), 1.0_wp)
            end associate
         end do
      end function pressing

   end subroutine part

   !> Of what is held with forces beyond its bounds while others hold it anyway, friction is strained and sides are let go of: those
   !> of `tie` that are `idle`, which nothing decides, then its others. In a set that obeys all laws their forces are their bounds;
   !> those of least norm may pull at a side that would press beside them.
   subroutine share(system, dynamics, tau, z, seen, tie, idle)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:), seen(2)
      type(tie_t), intent(in) :: tie(:)
      logical, intent(in) :: idle(:)

      type(derivatives_t) :: derivatives
      integer, allocatable :: way(:)
      integer :: held, i, j, pass, undecided

      again: do
         call dynamics%mode%enter(system)
         if (dynamics%mode%constraints%rank == dynamics%mode%constraints%count) return
         call differentiate(derivatives, system, dynamics, tau, z, seen, highest)
         way = [(beyond_bound(dynamics%mode%constraints%contact(i)), i=1, dynamics%mode%constraints%count)]
         if (all(way == 0)) return
         do pass = 1, 3
            do i = 1, dynamics%mode%constraints%count
               j = dynamics%mode%constraints%contact(i)
               undecided = findloc(idle .and. tie%contact == j .and. tie%held == dynamics%mode%branch(j), .true., dim=1)
               if (undecided > 0) way(i) = nint(tie(undecided)%direction)
               if (way(i) == 0 .or. pass /= merge(1, merge(2, 3, any(tie%contact == j)), undecided > 0)) cycle
               associate (law => system%machine%contact(j)%law, branch => dynamics%mode%branch(j))
                  held = branch
                  branch = merge(law%branch(held)%force_guard%below, law%branch(held)%force_guard%above, way(i) < 0)
                  if (law%of_normal) branch = merge(strained_backward, strained_forward, way(i) < 0)
                  call dynamics%mode%enter(system)
                  if (.not. norm2(dynamics%mode%constraints%free_part(dynamics%w, j)) > 0.0_wp) cycle again
                  branch = held
               end associate
               call dynamics%mode%enter(system)
            end do
         end do
         return
      end do again

   contains

      !> The direction in which the force of contact j is beyond its bound, else 0.
      integer function beyond_bound(j)
         integer, intent(in) :: j

         integer :: k

         beyond_bound = 0
         associate (branch => dynamics%mode%branch(j))
            do k = 1, -1, -2
               if (room_of(system, derivatives, j, branch, real(k, wp), 0) < 0.0_wp) beyond_bound = k
            end do
         end associate
      end function beyond_bound

   end subroutine share

   !> The friction elements that weaken, `jumps`, whose forces leave their limits as they all stick, or whose guards were left while
   !> nothing decides; and what was strained beside them.
   subroutine find_loose(system, dynamics, tau, z, seen, tie, jumps, loose)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:), seen(2)
      type(tie_t), intent(in) :: tie(:)
      logical, intent(in) :: jumps(:)
      logical, intent(inout) :: loose(:)

      type(derivatives_t) :: derivatives
      real(wp) :: room
      integer :: branch(size(loose)), i, j

      call dynamics%mode%enter(system)
      if (.not. any(jumps)) return
      call differentiate(derivatives, system, dynamics, tau, z, seen, highest)
      branch = dynamics%mode%branch
      do i = 1, size(tie)
         j = tie(i)%contact
         if (branch(j) /= branch_sticking) cycle
         room = room_of(system, derivatives, j, branch_sticking, tie(i)%direction, 0)
         if (room > 0.0_wp .or. .not. (room < 0.0_wp .or. tie(i)%left)) cycle
         dynamics%mode%branch(j) = tie(i)%free
         loose(j) = jumps(i)
         if (loose(j)) branch(j) = tie(i)%free
      end do
      call dynamics%mode%enter(system)
      do j = 1, size(loose)
         if (.not. system%machine%contact(j)%law%of_normal .or. branch(j) < strained_forward) cycle
         if (.not. norm2(dynamics%mode%constraints%free_part(dynamics%w, j)) > 0.0_wp) cycle
         branch(j) = merge(branch_forward, branch_backward, branch(j) == strained_forward)
         loose(j) = weakens(system%machine%contact(j), branch(j))
      end do
      dynamics%mode%branch = branch
   end subroutine find_loose

   !> How far the force of contact j, or from the derivative `first` on the first that is not 0, is from its bound in a `direction`
   !> while it is held in `branch`; 0 if it is there in all that are known.
   pure function room_of(system, derivatives, j, branch, direction, first) result(room)
      type(system_t), intent(in) :: system
      type(derivatives_t), intent(in) :: derivatives
      integer, intent(in) :: j, branch, first
      real(wp), intent(in) :: direction
      real(wp) :: room

      integer :: n

      room = 0.0_wp
      associate (guard => system%machine%contact(j)%law%branch(branch)%force_guard)
         if (merge(guard%above, guard%below, direction > 0.0_wp) == 0) return
         do n = first, derivatives%highest - 2
            room = merge(guard%upper, guard%lower, direction > 0.0_wp)*derivatives%normal(j, n)
            room = direction*(room - derivatives%force(j, n))
            if (abs(room) > noise_of(derivatives, system, j, n + 2)/system%reach(j)**2) return
            room = 0.0_wp
         end do
      end associate
   end function room_of

end module razy_hybrid_ties
