!! The six rigid motions of each shaft, and which of them supports and bearings hold.
module razy_rotor_shaft_motions
   use razy_core_kinds, only: wp
   use razy_rotor_numbering, only: numbering_t
   use razy_rotor_rotor, only: rotor_t
   implicit none(type, external)
   private

   public :: append, first_column, list_bearings, list_held, list_motions

contains

   !> How the six coordinates of each node move (6 shafts, 6 nodes) in the rigid motions of the shafts: along x, y and z, about x,
   !> and about y and z through the first node, where w = -x theta and v = x psi.
   pure subroutine list_motions(rotor, moved)
      type(rotor_t), intent(in) :: rotor
      real(wp), intent(out) :: moved(:, :)

      integer :: column, k, node, s

      moved = 0.0_wp
      column = 0
      do s = 1, size(rotor%shaft)
         associate (x => rotor%shaft(s)%positions(), row => 6*(s - 1))
            do node = 1, size(x)
               do k = 1, 6
                  moved(row + k, column + k) = 1.0_wp
               end do
               moved(row + 5, column + 3) = -x(node)
               moved(row + 6, column + 2) = x(node)
               column = column + 6
            end do
         end associate
      end do
   end subroutine list_motions

   !> The columns of `moved` of coordinates that are not there.
   pure subroutine list_held(numbering, moved, held)
      type(numbering_t), intent(in) :: numbering
      real(wp), intent(in) :: moved(:, :)
      real(wp), allocatable, intent(out) :: held(:, :)

      integer :: i

      associate (at => reshape(numbering%at, [size(moved, 2)]))
         held = moved(:, pack([(i, i=1, size(at))], at == 0))
      end associate
   end subroutine list_held

   !> Append what bearings feel by stiffness, and tilts of shafts that carry tension, which does not tilt with them, or
   !> torque, or else what bearings feel by damping (6 shafts, k).
   pure subroutine list_bearings(rotor, moved, by_stiffness, felt)
      type(rotor_t), intent(in) :: rotor
      real(wp), intent(in) :: moved(:, :)
      logical, intent(in) :: by_stiffness
      real(wp), allocatable, intent(inout) :: felt(:, :)

      real(wp) :: at_node(6, 6)
      real(wp) :: between(size(moved, 1), 6)
      integer :: first, i

      do i = 1, size(rotor%bearing)
         associate (bearing => rotor%bearing(i))
            first = first_column(rotor, bearing%shaft) + 6*(bearing%node - 1)
            at_node = merge(bearing%stiffness + bearing%cross_stiffness, bearing%damping + bearing%cross_damping, by_stiffness)
            ! A table is of the two directions across the shaft, whatever it says at this speed.
            if (allocated(bearing%table)) at_node(2:3, 2:3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
            between = moved(:, first + 1:first + 6)
            if (bearing%to_shaft > 0) then
               first = first_column(rotor, bearing%to_shaft) + 6*(bearing%to_node - 1)
               between = between - moved(:, first + 1:first + 6)
            end if
            call append(felt, matmul(between, transpose(at_node)))
         end associate
      end do
      do i = 1, size(rotor%shaft)
         if (.not. by_stiffness .or. .not. any(rotor%shaft(i)%section%carries())) cycle
         first = first_column(rotor, i)
         call append(felt, moved(:, first + 5:first + 6))
      end do
   end subroutine list_bearings

   !> The column before the first of shaft s.
   pure integer function first_column(rotor, s)
      type(rotor_t), intent(in) :: rotor
      integer, intent(in) :: s

      integer :: i

      first_column = 6*sum([(rotor%shaft(i)%nodes(), i=1, s - 1)])
   end function first_column

   !> Add columns (n, any) to a list (n, any).
   pure subroutine append(list, columns)
      real(wp), allocatable, intent(inout) :: list(:, :)
      real(wp), intent(in) :: columns(:, :)

      list = reshape([list, columns], [size(list, 1), size(list, 2) + size(columns, 2)])
   end subroutine append

end module razy_rotor_shaft_motions
