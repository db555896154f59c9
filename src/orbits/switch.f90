!! From a point of a branch to another branch through it: that of twice the period at a doubling, the other one at a branch point.
module razy_orbits_switch
   use razy_core_kinds, only: wp
   use razy_linalg_eigen, only: right_eigen
   use razy_linalg_square, only: bordered
   use razy_orbits_periodic_identity, only: doubled, part_way
   use razy_orbits_periodic_newton, only: complete, correct
   use razy_orbits_periodic_orbit, only: orbit_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_branch_point, only: point_t
   implicit none(type, external)
   private

   public :: switch_branch

   !> First distances from the point, in scaled unknowns, one after the other; farther off than so many of them is another motion.
   real(wp), parameter :: nearest = 2.0_wp
   real(wp), parameter :: distances(*) = [1.0e-4_wp, 1.0e-5_wp, 1.0e-6_wp, 1.0e-3_wp, 1.0e-2_wp]

contains

   !> The first motion of the other branch through `point`, and the direction in which it goes on; on the other side if not
   !> `forward`. `away`: how far it is from the point, in scaled unknowns. At a doubling the problem's periods double.
   subroutine switch_branch(problem, point, forward, orbit, guide, away, ok)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: point
      logical, intent(in) :: forward
      type(orbit_t), intent(out) :: orbit
      real(wp), allocatable, intent(out) :: guide(:)
      real(wp), intent(out) :: away
      logical, intent(out) :: ok

      type(orbit_t) :: there
      integer :: i, order, round
      logical :: told
      real(wp), allocatable :: apart(:), from(:), leading(:)

      call problem%begin_as(point%orbit)
      from = point%orbit%u
      if (point%label == "PD") from = doubled(problem, from)
      if (point%label == "PD") problem%periods = 2*problem%periods
      order = problem%order()
      call find_directions(problem, point, guide, leading)
      if (.not. forward) guide = -guide
      if (.not. forward) leading = -leading
      call problem%evaluate(from, .false., there, told)
      ! At first only such as have the sequence of contacts of the point, so that no grazing lies between.
      do round = merge(1, 2, told), 2
         do i = 1, size(distances)
            away = distances(i)
            ! So far off that it is told from motions of the branch.
            if (point%label /= "PD") away = away*max(1.0_wp, norm2(from(:order)))
            if (allocated(orbit%column)) deallocate (orbit%column)
            call correct(problem, from + away*leading, guide, orbit, ok)
            ! Of all motions in the plane across the direction the nearest; how far the parameter moves depends on its unit.
            if (ok) ok = norm2(orbit%u(:order) - from(:order)) < nearest*away
            if (ok .and. round == 1) ok = orbit%sequence%is_like(there%sequence)
            if (ok .and. point%label == "PD") then
               ! After half the period the motion is on the other side of the point, as far off.
               apart = part_way(problem, orbit, 2)
               ok = size(apart) > 0
               if (ok) ok = abs(dot_product(apart, leading(:size(apart)))/away + 2.0_wp) < 1.0_wp
            end if
            if (ok) call complete(problem, orbit, ok)
            ! The multiplier 1 of the point has not gone far, as past a further doubling.
            if (ok .and. round == 1) ok = minval(abs(orbit%multiplier - 1.0_wp)) < 0.5_wp
            if (ok) return
         end do
      end do
   end subroutine switch_branch

   !> `leading`: the unit vector of the multiplier -1 or 1, along motions of the other branch where that doubles or loses a
   !> symmetry; it may lean far over to the tangent of the branch. `guide`: the same across the tangent.
   subroutine find_directions(problem, point, guide, leading)
      type(problem_t), intent(in) :: problem
      type(point_t), intent(in) :: point
      real(wp), allocatable, intent(out) :: guide(:), leading(:)

      complex(wp), allocatable :: values(:), vectors(:, :)
      real(wp), allocatable :: matrix(:, :), state(:), tangent(:)
      integer :: info, k, n

      if (point%turns) then
         ! The branch that turns here goes along that vector itself, the other one across it.
         n = size(point%tangent)
         matrix = bordered(problem%jacobian(point%orbit), point%tangent)
         allocate (values(n), vectors(n, n))
         call right_eigen(matrix, values, info, vectors)
         guide = real(vectors(:, minloc(abs(values), dim=1)), wp)
         guide = guide/norm2(guide)
         leading = guide
         return
      end if
      n = problem%map%n
      matrix = point%orbit%monodromy()
      allocate (values(n), vectors(n, n))
      call right_eigen(matrix, values, info, vectors)
      k = minloc(abs(values - merge(-1.0_wp, 1.0_wp, point%label == "PD")), dim=1)
      state = real(vectors(:, k), wp)
      leading = [real(wp) ::]
      do k = 1, problem%states()/n
         leading = [leading, state]
         state = [matmul(point%orbit%derivative(:, :, 1 + modulo(k - 1, size(point%orbit%derivative, 3))), state)]
      end do
      leading = [leading, spread(0.0_wp, 1, problem%order() + 1 - size(leading))]/problem%scales()
      tangent = point%tangent
      if (point%label == "PD") tangent = doubled(problem, tangent)
      guide = leading - tangent*(dot_product(leading, tangent)/dot_product(tangent, tangent))
      if (point%label == "PD") guide(size(guide)) = 0.0_wp
      guide = guide/norm2(guide)
      leading = leading*(sign(1.0_wp, dot_product(leading, guide))/norm2(leading))
   end subroutine find_directions

end module razy_orbits_switch
