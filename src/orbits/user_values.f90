!! The motions of a branch at values of the parameter that the user names: UZ.
!!
!! Between two neighbouring motions of a branch with the value between theirs the motion is found in planes across the chord, which
!! are regular at a fold too, until rounding is all that is missing in the value.
module razy_orbits_user_values
   use razy_core_kinds, only: wp
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_orbits_branch_branch, only: branch_t
   use razy_orbits_periodic_newton, only: correct
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_periodic_section, only: carry
   use razy_orbits_branch_point, only: complete_point_at, point_t
   implicit none(type, external)
   private

   public :: mark_values

   !> Part of the chord to which the value is located.
   real(wp), parameter :: nearly = 1.0e-14_wp
   !> A motion is at a value if nothing but rounding parts them.
   real(wp), parameter :: rounding = 8*epsilon(1.0_wp)

contains

   !> Insert into a branch the motions at these values of the parameter, in its scale; one that is there has its label.
   subroutine mark_values(branch, problem, values)
      type(branch_t), intent(inout) :: branch
      type(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: values(:)

      type(point_t), allocatable :: marked(:)
      type(point_t) :: at
      logical :: found, left(size(values))
      integer :: count, i, k, last

      if (size(values) == 0 .or. branch%count < 2) return
      allocate (marked(branch%count*(size(values) + 1)))
      last = size(branch%point(1)%orbit%u)
      count = 1
      marked(1) = branch%point(1)
      if (branch%parent == 0 .and. marked(1)%label == "" .and. any(is_at(marked(1)))) marked(1)%label = "UZ"
      do i = 2, branch%count
         associate (a => branch%point(i - 1), b => branch%point(i))
            left = (values - a%orbit%u(last))*(b%orbit%u(last) - values) > 0.0_wp .and. .not. (is_at(a) .or. is_at(b))
            do while (any(left))
               k = minloc(abs(values - a%orbit%u(last)), dim=1, mask=left)
               left(k) = .false.
               call find_value(problem, a, b, values(k), at, found)
               if (.not. found) cycle
               count = count + 1
               marked(count) = at
            end do
            count = count + 1
            marked(count) = b
            if (b%label == "" .and. any(is_at(b))) marked(count)%label = "UZ"
         end associate
      end do
      branch%count = count
      branch%point = marked(:count)

   contains

      pure function is_at(point)
         type(point_t), intent(in) :: point
         logical :: is_at(size(values))

         is_at = abs(point%orbit%u(last) - values) <= rounding*abs(values)
      end function is_at

   end subroutine mark_values

   !> The motion at a value of the parameter between two neighbouring ones, at the phase of the second.
   subroutine find_value(problem, a, b, value, at, found)
      type(problem_t), intent(inout) :: problem
      type(point_t), intent(in) :: a, b
      real(wp), intent(in) :: value
      type(point_t), intent(out) :: at
      logical, intent(out) :: found

      type(bracketed_root_t) :: root
      real(wp), allocatable :: chord(:), row(:), start(:)
      integer :: last

      last = size(b%orbit%u)
      call problem%begin_as(b%orbit)
      call carry(problem, a%orbit%u, a%orbit%phase, modulo(b%orbit%phase - a%orbit%phase, 1.0_wp), start, found)
      if (.not. found) return
      chord = b%orbit%u - start
      row = chord/norm2(chord)
      call root%start(0.0_wp, start(last) - value, 1.0_wp, b%orbit%u(last) - value, nearly)
      do while (.not. root%done())
         if (allocated(at%orbit%column)) deallocate (at%orbit%column)
         call correct(problem, start + root%trial*chord, row, at%orbit, found)
         if (.not. found) return
         call root%take(at%orbit%u(last) - value)
      end do
      call correct(problem, start + root%best*chord, row, at%orbit, found)
      at%orbit%u(last) = value
      if (found) call complete_point_at(problem, at, chord, found)
      at%label = "UZ"
   end subroutine find_value

end module razy_orbits_user_values
