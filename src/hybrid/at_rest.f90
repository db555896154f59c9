!! What is brought to rest where a sequence of impacts ends: the speeds of its gaps, with what friction gave and will give.
module razy_hybrid_at_rest
   use razy_contact_friction_law, only: branch_sticking
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t, new_constraints
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_saltation, only: saltation_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: is_held, take_out

contains

   !> Whether contact j is closed rigidly, or sticks under one that is; or is friction with a given normal force that stuck until
   !> the impact, as in branches `was`: after the last it does for good, so all that it slides is taken back in its direction.
   pure logical function is_held(system, branch, was, j) result(held)
      type(system_t), intent(in) :: system
      integer, intent(in) :: branch(:), was(:), j

      associate (contact => system%machine%contact, by => system%machine%contact(j)%normal_of)
         held = contact(j)%law%branch(branch(j))%constraint
         if (contact(j)%law%of_normal .and. by == 0) held = was(j) == branch_sticking
         if (contact(j)%law%impacts .or. by == 0 .or. .not. held) return
         held = contact(by)%law%branch(branch(by))%constraint
      end associate
   end function is_held

   !> Take the speeds of the gaps of the contacts `list`, which open in `direction` of s, out of y' (m). The first `n` end their
   !> sequences; the others are held, and would be thrown up by that. Out goes also what has been given by the friction that
   !> slides under them, and for the time until their `ends`, s, what will be given by that which slides only while they are closed,
   !> with what it does to the gaps. In the limit gap and speed are none, whatever they were.
   subroutine take_out(system, dynamics, list, n, direction, ends, speed, saltation)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      integer, intent(in) :: list(:), n
      real(wp), intent(in) :: direction(:), ends(:)
      real(wp), intent(inout) :: speed(:)
      type(saltation_t), intent(inout) :: saltation

      type(constraints_t) :: constraints
      real(wp), dimension(system%m, size(list)) :: along, effect
      real(wp) :: edge(size(list)), unit(size(list)), given(system%m), still(system%m)
      real(wp), allocatable :: phi(:)
      integer, allocatable :: row(:), sliding(:)
      integer :: i, j
      logical :: found

      allocate (sliding(0), row(0), phi(0))
      do j = 1, size(dynamics%mode%branch)
         associate (contact => system%machine%contact(j), branch => dynamics%mode%branch(j))
            if (.not. (any(list == contact%normal_of) .and. contact%law%of_normal)) cycle
            if (contact%law%branch(branch)%constraint) cycle
            sliding = [sliding, j]
            row = [row, findloc(list, contact%normal_of, 1)]
            phi = [phi, contact%law%force(branch, dynamics%s(j), dynamics%rate(j), 1.0_wp)]
         end associate
      end do
      call new_constraints(constraints, system%w, list, sliding, row, -direction(row))
      edge = dynamics%rate(list) - matmul(speed, system%w(:, list))
      along = 0.0_wp
      do i = 1, size(list)
         unit = 0.0_wp
         unit(i) = 1.0_wp
         call constraints%displace(system%w, -unit, along(:, i))
         effect(:, i) = effect_of(unit)
      end do
      given = 0.0_wp
      do j = 1, size(dynamics%mode%branch)
         associate (contact => system%machine%contact(j), branch => dynamics%mode%branch(j))
            i = findloc(list(:n), contact%only_with, 1)
            if (i == 0 .or. contact%law%branch(branch)%constraint) cycle
            given = given + system%w(:, j)*(contact%law%force(branch, dynamics%s(j), dynamics%rate(j), contact%normal)*ends(i))
         end associate
      end do
      speed = speed + given + matmul(effect, dynamics%rate(list) + matmul(given, system%w(:, list)))
      if (.not. saltation%wanted) return
      still = 0.0_wp
      call saltation%add_impulses(effect, system%w(:, list), [(dynamics%second_rate(system, list(i), still), i=1, size(list))])
      call saltation%add_projection(along, system%w(:, list), edge)

   contains

      !> What these speeds of the gaps (list) give to y' (m).
      function effect_of(rate) result(change)
         real(wp), intent(in) :: rate(:)
         real(wp) :: change(system%m)

         real(wp) :: impulse(size(list))
         integer :: k

         call constraints%solve(rate, phi, impulse, found)
         change = 0.0_wp
         if (.not. found) then
            call constraints%displace(system%w, -rate, change)
            return
         end if
         change = -matmul(system%w(:, list), impulse)
         do k = 1, size(sliding)
            change = change + system%w(:, sliding(k))*(phi(k)*direction(row(k))*impulse(row(k)))
         end do
      end function effect_of

   end subroutine take_out

end module razy_hybrid_at_rest
