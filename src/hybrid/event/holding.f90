!! Who holds after an event: of the sides that touch and the friction that rests, accelerations say which separate, slide, or stay
!! closed and stick (razy_hybrid_active_sides), and further derivatives where these are 0 (razy_hybrid_ties).
module razy_hybrid_event_holding
   use razy_contact_friction_law, only: branch_backward, branch_forward, branch_sticking
   use razy_contact_gap_law, only: branch_open
   use razy_core_kinds, only: wp
   use razy_hybrid_active_sides, only: assume, choose, either_way, on_limit, weakens
   use razy_hybrid_derivatives, only: derivatives_t, differentiate
   use razy_hybrid_dynamics, only: accelerate_unconstrained, dynamics_t
   use razy_hybrid_mode, only: lawful
   use razy_hybrid_system, only: system_t
   use razy_hybrid_ties, only: break_ties, noise_of, tie_t
   use razy_hybrid_transition, only: transition_t
   implicit none(type, external)
   private

   public :: slide_out_of_play, sort_friction, take_forces

   !> Decisions at one event, for each contact and one more: more of them go round.
   integer, parameter :: most_rounds = 4

contains

   !> Which friction elements slide and which rest.
   subroutine sort_friction(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: j

      do j = 1, size(self%next)
         if (.not. (system%machine%contact(j)%law%of_normal .and. self%stirred(j)) &
             .or. self%let_go(j) .and. self%impacts == 0) cycle
         self%resting(j) = abs(self%dynamics%rate(j)) <= self%guards%on_rate(j) .and. .not. self%let_go(j)
         if (abs(self%dynamics%rate(j)) <= self%guards%on_rate(j)) cycle
         ! Whether it returns is no question where an impact at the same time gave it a speed.
         self%let_go(j) = .false.
         self%next(j) = merge(branch_forward, branch_backward, self%dynamics%rate(j) > 0.0_wp)
      end do
   end subroutine sort_friction

   !> The branches from what is certain and, for candidates, from problems of accelerations and of further derivatives: one, and one
   !> more after friction elements that begin to slide with less than the force of sticking, and after contacts that do not leave
   !> although they were let go of, as others that did so have changed their forces.
   subroutine take_forces(self, system, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)

      real(wp), dimension(size(self%next)) :: noise, normal, per_normal, second_rate
      integer :: round, tied(size(self%next))
      logical :: loose(size(self%next)), returned
      type(tie_t), allocatable :: tie(:)

      associate (contact => system%machine%contact, side => self%side(:self%sides))
         do round = 1, most_rounds*(size(self%next) + 1)
            call assume(contact, side, self%resting, self%stirred, self%next)
            self%dynamics%mode%branch = self%next
            tied = 0
            loose = .false.
            if (any(self%resting) .or. any(side%candidate)) then
               call accelerations(self%dynamics, system, tau, z, self%guards%seen, second_rate, noise, normal, per_normal)
               call choose(contact, self%dynamics%w, side, self%resting, second_rate, noise, normal, per_normal, self%next, &
                           loose, tied, self%found)
               if (.not. self%found) return
               self%dynamics%mode%branch = self%next
            end if
            if (.not. any(loose)) then
               call find_ties(self, system, tau, z, tied, tie, returned)
               if (returned) cycle
               call break_ties(system, self%dynamics, tau, z, self%guards, tie, loose)
               self%next = self%dynamics%mode%branch
               if (.not. any(loose)) return
            end if
            self%resting = self%resting .and. .not. loose
            self%let_go = self%let_go .or. loose
            self%yielding = 0
         end do
      end associate
   end subroutine take_forces

   !> The contacts that are tied in the mode as it is: those that `choose` says (contacts), and those that were let go of while
   !> their acceleration is 0. Those that do not leave are candidates again, once: some have `returned`.
   subroutine find_ties(self, system, tau, z, tied, tie, returned)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      integer, intent(in) :: tied(:)
      type(tie_t), allocatable, intent(out) :: tie(:)
      logical, intent(out) :: returned

      type(derivatives_t) :: derivatives
      real(wp) :: a(system%m)
      logical :: back(size(tied)), pressed(size(tied))
      integer :: i, j, way

      allocate (tie(0))
      returned = .false.
      associate (branch => self%dynamics%mode%branch, contact => system%machine%contact, side => self%side(:self%sides))
         do i = 1, self%sides
            j = side(i)%contact
            if (.not. (side(i)%candidate .and. side(i)%tied)) cycle
            if (any(side%contact == j .and. side%candidate .and. .not. side%tied .and. side%closed == branch(j))) cycle
            tie = [tie, tie_t(j, side(i)%closed, branch_open, side(i)%direction)]
         end do
         ! Which of more feet than are needed bear nothing is open: here they all do.
         if (any(tied == either_way)) then
            call self%dynamics%mode%enter(system)
            call self%dynamics%accelerate(system, tau, z, a)
         end if
         pressed = self%dynamics%mode%constraints%rank < self%dynamics%mode%constraints%count .and. contact%normal_of > 0 &
                   .and. self%dynamics%normal > on_limit*maxval(self%dynamics%normal)
         do j = 1, size(tied)
            associate (left => self%yielding(j) /= 0 .and. branch(j) == branch_sticking)
               way = merge(merge(1, -1, self%yielding(j) == branch_forward), tied(j), left)
               if (way == either_way .and. pressed(j)) way = merge(1, -1, self%dynamics%force(j) > 0.0_wp)
               if (way == 0) cycle
               if (way == either_way) then
                  tie = [tie, tie_t(j, branch_sticking, branch_forward, 1.0_wp, unpressed=.true.), &
                         tie_t(j, branch_sticking, branch_backward, -1.0_wp, unpressed=.true.)]
                  cycle
               end if
               tie = [tie, tie_t(j, branch_sticking, merge(branch_forward, branch_backward, way > 0), real(way, wp), left)]
            end associate
         end do
         if (.not. any(self%let_go)) return
         call self%dynamics%mode%enter(system)
         call differentiate(derivatives, system, self%dynamics, tau, z, self%guards%seen, 2)
         back = .false.
         do j = 1, size(tied)
            if (self%again(j) .or. .not. self%let_go(j) .or. contact(j)%law%branch(branch(j))%constraint) cycle
            way = leaves(j)
            if (abs(derivatives%s(j, 2)) > noise_of(derivatives, system, j, 2)) then
               back(j) = way*derivatives%s(j, 2) < 0.0_wp
            else if (contact(j)%law%of_normal .and. weakens(contact(j), branch(j))) then
               back(j) = .true.
            else
               tie = [tie, tie_t(j, self%before(j), branch(j), real(way, wp), left=.true.)]
            end if
            if (back(j)) self%resting(j) = contact(j)%law%of_normal
         end do
         returned = any(back)
         self%again = self%again .or. back
         self%let_go = self%let_go .and. .not. back
         side%candidate = side%candidate .or. (back(side%contact) .and. side%closed == self%before(side%contact))
      end associate

   contains

      !> The sign of s in which contact j leaves.
      integer function leaves(j)
         integer, intent(in) :: j

         associate (law => system%machine%contact(j)%law)
            leaves = merge(1, -1, merge(self%before(j) == law%branch(branch_open)%guard(1)%below, &
                                        self%dynamics%mode%branch(j) == branch_forward, law%impacts))
         end associate
      end function leaves

   end subroutine find_ties

   !> Friction that nothing presses does not stick.
   subroutine slide_out_of_play(self, system)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system

      integer :: j

      associate (branch => self%dynamics%mode%branch, mode => self%dynamics%mode)
         do j = 1, size(branch)
            if (self%resting(j) .and. branch(j) == branch_sticking .and. .not. mode%in_play(system, j)) branch(j) = branch_forward
         end do
      end associate
   end subroutine slide_out_of_play

   !> s'' of all contacts without the constraint forces of the mode, and its rounding; normal forces of friction without those, and
   !> the forces of sliding friction per normal force (contacts each).
   subroutine accelerations(dynamics, system, tau, z, seen, second_rate, noise, normal, per_normal)
      type(dynamics_t), intent(inout) :: dynamics
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:), seen(2)
      real(wp), intent(out) :: second_rate(:), noise(:), normal(:), per_normal(:)

      type(derivatives_t) :: derivatives
      real(wp) :: a(system%m)
      integer :: j

      call dynamics%mode%enter(system)
      call differentiate(derivatives, system, dynamics, tau, z, seen, 2)
      call accelerate_unconstrained(dynamics, system, tau, z, a)
      per_normal = 0.0_wp
      do j = 1, size(second_rate)
         second_rate(j) = dynamics%second_rate(system, j, a)
         noise(j) = noise_of(derivatives, system, j, 2)
         normal(j) = dynamics%normal_of(system, j)
         associate (law => system%machine%contact(j)%law)
            if (dynamics%mode%does(j) /= lawful .or. .not. law%of_normal) cycle
            per_normal(j) = law%force(dynamics%mode%branch(j), dynamics%s(j), dynamics%rate(j), 1.0_wp)
         end associate
      end do
   end subroutine accelerations

end module razy_hybrid_event_holding
