!! Which coordinates a rotor system has, and their numbers: shaft by shaft, node by node, those that are held left out.
module razy_rotor_numbering
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_rotor_bearing, only: bearing_t
   use razy_rotor_rotor, only: longest_name, rotor_t
   implicit none(type, external)
   private

   public :: numbering_t, new_numbering, add_at, coordinate_names, values_at

   character(5), parameter :: coordinate_names(6) = [character(5) :: "u", "v", "w", "phi", "theta", "psi"]
   integer, parameter :: longest_coordinate = longest_name + 16

   type :: numbering_t
      !> Number of coordinates.
      integer :: n = 0
      !> Node k of shaft s is node `first_node(s)` - 1 + k of the system; `first_node(shafts + 1)` - 1 is the last.
      integer, allocatable, private :: first_node(:)
      !> Coordinates of shaft s: `first(s)` to `first(s + 1)` - 1.
      integer, allocatable :: first(:)
      !> Number of a coordinate (6, nodes of the system), 0 if it is not there.
      integer, allocatable :: at(:, :)
      !> Shaft, node of the shaft, and which of the six, of each coordinate (n).
      integer, allocatable :: shaft(:), node(:), kind(:)
   contains
      procedure :: of
      procedure :: ends
      procedure :: stretch
      procedure :: name
   end type numbering_t

contains

   !> Numbers of the coordinates that supports leave free, shaft after shaft.
   pure function new_numbering(rotor) result(numbering)
      type(rotor_t), intent(in) :: rotor
      type(numbering_t) :: numbering

      logical, allocatable :: free(:, :)
      integer :: i, k, node, s

      allocate (numbering%first_node(size(rotor%shaft) + 1), numbering%first(size(rotor%shaft) + 1))
      numbering%first_node(1) = 1
      do s = 1, size(rotor%shaft)
         numbering%first_node(s + 1) = numbering%first_node(s) + rotor%shaft(s)%nodes()
      end do
      free = spread([rotor%axial, rotor%bending, rotor%bending, rotor%torsion, rotor%bending, rotor%bending], 2, &
                    numbering%first_node(size(rotor%shaft) + 1) - 1)
      do i = 1, size(rotor%support)
         associate (support => rotor%support(i))
            node = numbering%first_node(support%shaft) - 1 + support%node
            free(:, node) = free(:, node) .and. .not. support%fixed
         end associate
      end do
      allocate (numbering%at(6, size(free, 2)), source=0)
      allocate (numbering%shaft(count(free)), numbering%node(count(free)), numbering%kind(count(free)))
      do s = 1, size(rotor%shaft)
         numbering%first(s) = numbering%n + 1
         do node = numbering%first_node(s), numbering%first_node(s + 1) - 1
            do k = 1, 6
               if (.not. free(k, node)) cycle
               numbering%n = numbering%n + 1
               numbering%at(k, node) = numbering%n
               numbering%shaft(numbering%n) = s
               numbering%node(numbering%n) = node + 1 - numbering%first_node(s)
               numbering%kind(numbering%n) = k
            end do
         end do
      end do
      numbering%first(size(rotor%shaft) + 1) = numbering%n + 1
   end function new_numbering

   !> Numbers (6) of the coordinates of node `node` of shaft `shaft`.
   pure function of(self, shaft, node) result(index)
      class(numbering_t), intent(in) :: self
      integer, intent(in) :: shaft, node
      integer :: index(6)

      index = self%at(:, self%first_node(shaft) - 1 + node)
   end function of

   !> Numbers (12) of the coordinates of both ends of a bearing; 0 for the frame.
   pure function ends(self, bearing) result(index)
      class(numbering_t), intent(in) :: self
      type(bearing_t), intent(in) :: bearing
      integer :: index(12)

      index = 0
      index(:6) = self%of(bearing%shaft, bearing%node)
      if (bearing%to_shaft > 0) index(7:) = self%of(bearing%to_shaft, bearing%to_node)
   end function ends

   !> How a displacement `q` (n) stretches a bearing (6).
   pure function stretch(self, bearing, q) result(values)
      class(numbering_t), intent(in) :: self
      type(bearing_t), intent(in) :: bearing
      real(wp), intent(in) :: q(:)
      real(wp) :: values(6)

      integer :: at(12)

      at = self%ends(bearing)
      values = values_at(q, at(:6)) - values_at(q, at(7:))
   end function stretch

   !> The values of `q` (n) at the coordinates of a node; those that are held are zero.
   pure function values_at(q, at) result(values)
      real(wp), intent(in) :: q(:)
      integer, intent(in) :: at(6)
      real(wp) :: values(6)

      integer :: k

      values = 0.0_wp
      do k = 1, 6
         if (at(k) > 0) values(k) = q(at(k))
      end do
   end function values_at

   !> Add six numbers to a vector `q` (n) at the coordinates of a node, but for those that are held.
   pure subroutine add_at(q, at, part)
      real(wp), intent(inout) :: q(:)
      integer, intent(in) :: at(6)
      real(wp), intent(in) :: part(6)

      integer :: k

      do k = 1, 6
         if (at(k) > 0) q(at(k)) = q(at(k)) + part(k)
      end do
   end subroutine add_at

   !> Name of coordinate i: shaft, node and coordinate, such as `input.8.v`; a shaft without a name has its number.
   pure function name(self, rotor, i) result(text)
      class(numbering_t), intent(in) :: self
      type(rotor_t), intent(in) :: rotor
      integer, intent(in) :: i
      character(longest_coordinate) :: text

      text = rotor%shaft(self%shaft(i))%name
      if (len_trim(text) == 0) text = to_text(self%shaft(i))
      text = trim(text)//"."//to_text(self%node(i))//"."//trim(coordinate_names(self%kind(i)))
   end function name

end module razy_rotor_numbering
