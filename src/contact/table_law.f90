!! The piecewise-linear law of any number of lines: springs and stops whose force is given over s by a table, dampers and motors
!! whose force is given over s'.
!!
!! Through the points (d_i, f_i), i = 1 ... n, with line i between d_i and d_i+1,
!!
!!     F = f_i + (f_i+1 - f_i)/(d_i+1 - d_i) (s - d_i) + b_i s'.
!!
!! The first and the last line go on beyond the ends, or a motion that leaves the table has left what is known of the law. Slopes
!! may fall; without damping F is continuous. Over s' the lines are F = f_i + (f_i+1 - f_i)/(d_i+1 - d_i) (s' - d_i).
module razy_contact_table_law
   use razy_contact_contact_law, only: branch_t, contact_law_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   implicit none(type, external)
   private

   public :: lay_over_rate, new_table_law, table_law_t

   !> Switching function: s, or s'.
   type, extends(contact_law_t) :: table_law_t
      !> Number of lines, and where nothing is stored, m (rad).
      integer, private :: lines = 0
      real(wp), private :: rest = 0.0_wp
   contains
      procedure :: energy
      procedure :: smoothed
   end type table_law_t

contains

   !> A law from its points, `place` (n) rising, m (rad), and `force` (n), N (N m), and the damping of its lines (n - 1), N s/m (N m
   !> s/rad). At `rest` nothing is stored. The line there is that of an open contact if there is a `gap`. `ends`: whether the
   !> table is not to be left at its lower, its upper end.
   pure function new_table_law(place, force, damping, rest, gap, ends) result(law)
      real(wp), intent(in) :: place(:), force(:), damping(:), rest
      logical, intent(in) :: gap, ends(2)
      type(table_law_t) :: law

      integer :: beyond(2), i, n

      n = size(place) - 1
      law%piecewise_linear = .true.
      law%slope(1, 1) = 1.0_wp
      law%lines = n
      law%rest = rest
      law%home = 1 + count(place(2:n) <= rest)
      beyond = merge([n + 1, n + count(ends)], 0, ends)
      law%plain = n + count(ends)
      allocate (law%branch(law%plain))
      do i = 1, n
         associate (line => law%branch(i))
            line%name = "line "//to_text(i)
            line%closed = .not. (gap .and. i == law%home)
            line%side = merge(merge(1, -1, i >= law%home), 0, line%closed)
            if (.not. line%closed) line%name = "open"
            line%stiffness = (force(i + 1) - force(i))/(place(i + 1) - place(i))
            line%damping = damping(i)
            line%offset = force(i) - line%stiffness*place(i)
            call line%guard(1)%bound(-1.0_wp, place(i), merge(beyond(1), i - 1, i == 1))
            call line%guard(1)%bound(1.0_wp, place(i + 1), merge(beyond(2), i + 1, i == n))
         end associate
      end do
      do i = 1, 2
         if (.not. ends(i)) cycle
         associate (outside => law%branch(beyond(i)))
            outside = law%branch(merge(1, n, i == 1))
            outside%outside = .true.
            outside%side = merge(-1, 1, i == 1)
            outside%name = "outside the table"
            outside%guard%below = 0
            outside%guard%above = 0
         end associate
      end do
      law%shut = law%home
      associate (open => law%branch(law%home)%guard(1))
         if (gap) law%shut = merge(open%above, open%below, open%above > 0)
      end associate
   end function new_table_law

   !> The same points over s'; the law has neither a gap nor another damping.
   pure subroutine lay_over_rate(law)
      type(table_law_t), intent(inout) :: law

      law%slope(:, 1) = [0.0_wp, 1.0_wp]
      law%branch%damping = law%branch%stiffness
      law%branch%stiffness = 0.0_wp
   end subroutine lay_over_rate

   !> Stored at s, from `rest` on line by line, J.
   pure function energy(self, branch, s)
      class(table_law_t), intent(in) :: self
      integer, intent(in) :: branch
      real(wp), intent(in) :: s
      real(wp) :: energy

      real(wp) :: from, to
      integer :: i, last, way

      last = branch
      if (last > self%lines) last = merge(self%lines, 1, self%branch(branch)%side > 0)
      way = merge(1, -1, last >= self%home)
      energy = 0.0_wp
      if (.not. self%slope(1, 1) > 0.0_wp) return
      from = self%rest
      do i = self%home, last, way
         associate (line => self%branch(i))
            to = merge(line%guard(1)%upper, line%guard(1)%lower, way > 0)
            if (i == last) to = s
            energy = energy + (to - from)*(0.5_wp*line%stiffness*(to + from) + line%offset)
         end associate
         from = to
      end do
   end function energy

   !> The first line, and what each further one has more than the one before, switched on by a smoothed step.
   pure subroutine smoothed(self, s, rate, normal, sharpness, force, stiffness, damping)
      class(table_law_t), intent(in) :: self
      real(wp), intent(in) :: s, rate, normal, sharpness
      real(wp), intent(out) :: force, stiffness, damping

      type(branch_t) :: more
      real(wp) :: share, x
      integer :: i

      associate (unused => normal, first => self%branch(1))
         force = first%stiffness*s + first%damping*rate + first%offset
         stiffness = first%stiffness
         damping = first%damping
      end associate
      do i = 2, self%lines
         more = self%branch(i)
         associate (before => self%branch(i - 1))
            more%stiffness = more%stiffness - before%stiffness
            more%damping = more%damping - before%damping
            more%offset = more%offset - before%offset
         end associate
         x = sharpness*(self%slope(1, 1)*s + self%slope(2, 1)*rate - more%guard(1)%lower)
         share = 0.5_wp + atan(x)/pi
         associate (step => more%stiffness*s + more%damping*rate + more%offset)
            force = force + share*step
            stiffness = stiffness + share*more%stiffness + self%slope(1, 1)*sharpness/(pi*(1.0_wp + x**2))*step
            damping = damping + share*more%damping + self%slope(2, 1)*sharpness/(pi*(1.0_wp + x**2))*step
         end associate
      end do
   end subroutine smoothed

end module razy_contact_table_law
