!! What the guards that were left say at an event: branches beyond them, or edges and friction that the decision of all contacts
!! is to look at. The state is put on their bounds, and friction that has come to rest does so to the last bit.
module razy_hybrid_event_left_guards
   use razy_core_kinds, only: wp
   use razy_hybrid_active_sides, only: weakens
   use razy_hybrid_guards, only: of_force, of_press
   use razy_hybrid_system, only: system_t
   use razy_hybrid_transition, only: transition_t
   implicit none(type, external)
   private

   public :: find_at_limit, keep_open, take_hits

   !> A flight that is so many roundings of its gap high, twice, is none of rounding, even if terms of a closed form give it more.
   real(wp), parameter :: higher = 1024.0_wp

contains

   !> Where friction has come to its limit, so has that which is there to rounding and goes on: whoever looks for the first does not
   !> see it.
   subroutine find_at_limit(self, system, tau, z, hit)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)
      logical, intent(inout) :: hit(:)

      real(wp), dimension(self%guards%count) :: g, rate
      logical :: limits(self%guards%count)

      associate (guards => self%guards, n => self%guards%count)
         limits = guards%entry(:n)%of_normal .and. guards%entry(:n)%function == of_force
         if (count(limits) < 2 .or. .not. any(limits .and. hit(:n))) return
         call guards%look(system, self%dynamics, tau, z, g, rate)
         ! A rate is a difference over `delta`.
         hit(:n) = hit(:n) .or. (limits .and. abs(g) <= guards%noise(:n) .and. rate*guards%delta < -guards%noise(:n))
      end associate
   end subroutine find_at_limit

   !> Branches beyond the guards hit; the state is put on their bounds, and friction that has come to rest does so to the last bit.
   subroutine take_hits(self, system, hit, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      integer :: i, j

      associate (guards => self%guards)
         if (any(hit(:guards%count))) call self%dynamics%keep_constraints(system, tau, z)
         do i = 1, guards%count
            if (.not. hit(i) .or. guards%entry(i)%function == of_press) cycle
            j = guards%entry(i)%contact
            associate (law => system%machine%contact(j)%law, next => guards%entry(i)%next)
               if (guards%entry(i)%function == of_force) then
                  if (law%of_normal) then
                     ! Of several that have come to their limits some may stick on as others slide.
                     if (weakens(system%machine%contact(j), next)) self%yielding(j) = next
                     if (self%yielding(j) /= 0) cycle
                  end if
                  self%next(j) = next
                  self%let_go(j) = .true.
                  cycle
               end if
               if (system%constrained) call put_on_bound(self, system, i, tau, z)
               if (law%impacts) then
                  self%left(merge(1, 2, guards%entry(i)%side > 0.0_wp), j) = .true.
               else if (law%branch(next)%constraint) then
                  self%resting(j) = .true.
               else
                  self%next(j) = next
               end if
            end associate
         end do
         ! That friction left its bound by the forces before says nothing of those after another contact has changed.
         if (any(self%next /= self%before .and. .not. self%let_go)) self%yielding = 0
      end associate
   end subroutine take_hits

   !> A gap that opens faster than a flight of rounding has not closed, whatever rounding says of its edge.
   subroutine keep_open(self, system, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: tau, z(:)

      real(wp) :: a(system%m), opens
      integer :: j, side

      associate (dynamics => self%dynamics, guards => self%guards)
         do side = 1, 2
            opens = merge(1.0_wp, -1.0_wp, side == 1)
            if (.not. any(self%left(side, :) .and. opens*dynamics%rate > guards%on_rate)) cycle
            call dynamics%accelerate(system, tau, z, a)
            self%left(side, :) = self%left(side, :) .and. &
                                 (opens*dynamics%rate <= guards%on_rate .or. dynamics%rate**2 <= higher*guards%on_s* &
                                  [(-opens*dynamics%second_rate(system, j, a), j=1, size(self%next))])
         end do
      end associate
   end subroutine keep_open

   !> Put z on the bound of guard i, where whoever found the event has it: the state is the sum of many terms, and errs by more than
   !> the function does. What is held stays so.
   subroutine put_on_bound(self, system, i, tau, z)
      type(transition_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      integer, intent(in) :: i
      real(wp), intent(in) :: tau
      real(wp), intent(inout) :: z(:)

      real(wp) :: along(system%m), miss, reach

      call self%dynamics%look_at_contacts(system, tau, z)
      associate (guard => self%guards%entry(i), m => system%m, j => self%guards%entry(i)%contact)
         miss = guard%alpha*self%dynamics%s(j) + guard%beta*self%dynamics%rate(j) + guard%gamma - guard%bound
         along = self%dynamics%mode%constraints%free_part(self%dynamics%w, j)
         reach = dot_product(self%dynamics%w(:, j), along)
         if (.not. reach > 0.0_wp) return
         if (abs(guard%alpha) > 0.0_wp) then
            z(:m) = z(:m) - along*(miss/(guard%alpha*reach))
         else
            z(m + 1:) = z(m + 1:) - along*(miss/(guard%beta*reach))
         end if
      end associate
   end subroutine put_on_bound

end module razy_hybrid_event_left_guards
